"""Demsmith as a plugin in the QGIS window."""

"""Demsmith's tools as QGIS's toolbox, models, batch and `qgis_process` see them."""

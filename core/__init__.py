"""NumPy in, NumPy out: everything Demsmith computes. Nothing here imports QGIS."""

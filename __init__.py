"""Demsmith mends, compresses and sharpens elevation models, inside QGIS and out of it.

This folder is the QGIS plugin and the Python package at once. Nothing but this file is read
when QGIS loads the plugin or Python imports the package: the public functions are looked up at
first use (PEP 562), and QGIS's classes when QGIS asks for them.
"""

__version__ = "0.1.0"

_PUBLIC = {
    "fill_voids": "demsmith.core.voids",
    "fill_file": "demsmith.core.voids",
    "Maps": "demsmith.core.mcmd",
    "read_raster": "demsmith.core.raster",
    "write_raster": "demsmith.core.raster",
    "Grid": "demsmith.core.raster",
    "Samples": "demsmith.core.samples",
    "from_samples": "demsmith.core.samples",
    "samples_file": "demsmith.core.samples",
    "When": "demsmith.core.solar",
    "solar_file": "demsmith.core.solar",
    "solar_irradiance": "demsmith.core.solar",
    "thin": "demsmith.core.thinning",
    "thin_file": "demsmith.core.thinning",
    "reconstruct": "demsmith.core.reconstruction",
    "reconstruct_file": "demsmith.core.reconstruction",
    "reconstruct_mosaic": "demsmith.core.mosaic",
    "drainage_area": "demsmith.core.hydrology",
    "drainage_file": "demsmith.core.hydrology",
    "slope": "demsmith.core.relief",
    "aspect": "demsmith.core.relief",
    "hillshade": "demsmith.core.relief",
    "mean_deviation": "demsmith.core.relief",
    "topographic_position": "demsmith.core.relief",
    "relief_file": "demsmith.core.relief",
    "learn": "demsmith.core.sparse",
    "learn_file": "demsmith.core.sparse",
    "proceduralize": "demsmith.core.procedural",
    "proceduralize_file": "demsmith.core.procedural",
    "read_terrain": "demsmith.core.procedural",
    "read_dictionary": "demsmith.core.sparse",
    "CompressOptions": "demsmith.core.sct",
    "DecompressOptions": "demsmith.core.sct",
    "compress_file": "demsmith.core.sct",
    "decompress_file": "demsmith.core.sct",
    "open_sct": "demsmith.core.sct",
    "validate": "demsmith.core.validation",
    "validate_file": "demsmith.core.validation",
}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name):
    if name in _PUBLIC:
        from importlib import import_module

        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'demsmith' has no attribute '{name}'")


def __dir__():
    return sorted(__all__)


def classFactory(iface):  # noqa: N802, the name QGIS looks for
    """Give QGIS the plugin."""
    from demsmith.plugin.main import DemsmithPlugin

    return DemsmithPlugin(iface)

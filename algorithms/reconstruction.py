"""What the tools share that reconstruct voids: auxiliary rasters, and what is told of a run."""

from qgis.core import QgsProcessing, QgsProcessingParameterMultipleLayers

from demsmith.algorithms.base import file_of
from demsmith.algorithms.parameters import add, tr

COUNTS = (
    ("VOIDS", "voids", "Voids found"),
    ("CELLS_FILLED", "cells_filled", "Cells filled"),
    ("CELLS_UNFILLED", "cells_unfilled", "Void cells left"),
    ("CELLS_FAULTY", "cells_faulty", "Known cells that were removed and filled"),
    ("LARGEST_VOID", "largest_void", "Cells of the largest void"),
    ("SECONDS", "seconds", "Run time [s]"),
)
"""Outputs that count: name, field of the result, title."""


def add_auxiliaries(tool):
    """Declare the rasters to fill from."""
    add(tool, QgsProcessingParameterMultipleLayers(
            "AUXILIARIES", tr("Auxiliary elevation models, in order of trust"),
            QgsProcessing.SourceType.TypeRaster, optional=True),
        help_text="Rasters of any CRS and resolution that know the ground in the voids, such as "
        "ASTER GDEM or Copernicus DEM; the first band of each. They are aligned to the elevation "
        "model, and used in each void where they promise less error than interpolation. Tiles of "
        "one model: give a virtual raster of them.")  # fmt: skip


def read_auxiliaries(tool, parameters, context):
    """Name the files of the auxiliary rasters; in the main thread, where layers are.

    Raises
    ------
    QgsProcessingException
        If a layer is no file that GDAL can open.
    """
    layers = tool.parameterAsLayerList(parameters, "AUXILIARIES", context)
    return [file_of(layer, "AUXILIARIES") for layer in layers]


def tell(result, feedback):
    """Write into the log what a reconstruction did.

    Parameters
    ----------
    result : ReconstructResult or MosaicResult
    feedback : QgsProcessingFeedback
    """
    for number, each in enumerate(result.auxiliaries, start=1):
        state = tr("aligned") if each["accepted"] else tr("refused")
        feedback.pushInfo(
            tr("auxiliary {}, {}: {}; {}").format(number, each["path"], state, each["reason"])
        )
    for warning in result.warnings:
        feedback.pushWarning(warning)
    feedback.pushInfo(
        tr("{} voids found; {} cells filled, {} left").format(
            result.voids, result.cells_filled, result.cells_unfilled
        )
    )
    for name, cells in result.cells_by_source.items():
        feedback.pushInfo(tr("{}: {} cells").format(name, cells))
    if result.cells_faulty:
        feedback.pushInfo(
            tr("{} known cells were not believed, and filled").format(result.cells_faulty)
        )

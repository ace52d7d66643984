"""What the tools of the group *Void filling* share: the group, and maps beside a filled raster."""

from qgis.core import QgsProcessingParameterRasterDestination

from demsmith.algorithms.parameters import add, tr


class VoidFilling:
    """A tool of the group *Void filling*; named before `Tool` among a tool's bases."""

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Void filling")

    def groupId(self):
        """Name the tool's group in ids."""
        return "voids"


def add_cell_maps(tool):
    """Declare the maps that tell of each cell where it comes from and how wrong it may be."""
    add(tool, QgsProcessingParameterRasterDestination(
            "SOURCE_MAP", tr("Source map"), optional=True, createByDefault=False),
        help_text="GeoTIFF that says of each cell where it comes from: 0 original, 2 a void "
        "left as it was, others by what the cell was filled.")  # fmt: skip
    add(tool, QgsProcessingParameterRasterDestination(
            "UNCERTAINTY", tr("Uncertainty"), optional=True, createByDefault=False),
        help_text="GeoTIFF of the standard error to be expected in filled cells, 0 in known "
        "ones. Method auto only.")  # fmt: skip

"""The Processing provider: the list of Demsmith's tools."""

import os

from qgis.core import Qgis, QgsMessageLog, QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

import demsmith
from demsmith.algorithms import dependencies

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
ICON = os.path.join(ROOT, "icon.svg")


class DemsmithProvider(QgsProcessingProvider):
    """All tools of Demsmith, under the id ``demsmith``."""

    def id(self):
        """Name the provider in tool ids, as in ``demsmith:fillvoids``."""
        return "demsmith"

    def name(self):
        """Name the provider in the toolbox."""
        return "Demsmith"

    def longName(self):
        """Name the provider and say what it is for."""
        return self.tr("Demsmith: mends, compresses and sharpens elevation models")

    def icon(self):
        """Show Demsmith's icon."""
        return QIcon(ICON)

    def svgIconPath(self):
        """Name the icon's file."""
        return ICON

    def versionInfo(self):
        """Tell Demsmith's version for the log of a run."""
        return demsmith.__version__

    def supportedOutputRasterLayerExtensions(self):
        """Rasters are written as GeoTIFF and nothing else."""
        return ["tif", "tiff"]

    def supportedOutputVectorLayerExtensions(self):
        """Points are written in these formats."""
        return ["gpkg", "geojson", "csv"]

    def supportsNonFileBasedOutput(self):
        """Every output is a file: no layers in memory, in databases or in a GeoPackage of many."""
        return False

    def loadAlgorithms(self):
        """Add the tools; none where Python is too old to read them."""
        if not dependencies.python_suffices():
            QgsMessageLog.logMessage(dependencies.problem(), "Demsmith", Qgis.MessageLevel.Warning)
            return
        from demsmith.algorithms.chain import chains
        from demsmith.algorithms.compress import Compress
        from demsmith.algorithms.decompress import Decompress
        from demsmith.algorithms.drainagearea import DrainageArea
        from demsmith.algorithms.fillvoids import FillVoids
        from demsmith.algorithms.inverseprocedural import InverseProcedural
        from demsmith.algorithms.learndictionary import LearnDictionary
        from demsmith.algorithms.reconstructfromsamples import ReconstructFromSamples
        from demsmith.algorithms.reconstructmosaic import ReconstructMosaic
        from demsmith.algorithms.reconstructsrtm import ReconstructSrtm
        from demsmith.algorithms.relief import Relief
        from demsmith.algorithms.solarirradiance import SolarIrradiance
        from demsmith.algorithms.thinraster import ThinRaster
        from demsmith.algorithms.validatefill import ValidateFill

        self.addAlgorithm(Compress())
        self.addAlgorithm(Decompress())
        self.addAlgorithm(DrainageArea())
        self.addAlgorithm(FillVoids())
        self.addAlgorithm(InverseProcedural())
        self.addAlgorithm(LearnDictionary())
        self.addAlgorithm(ReconstructFromSamples())
        self.addAlgorithm(ReconstructMosaic())
        self.addAlgorithm(ReconstructSrtm())
        self.addAlgorithm(Relief())
        self.addAlgorithm(SolarIrradiance())
        self.addAlgorithm(ThinRaster())
        self.addAlgorithm(ValidateFill())
        for chain in chains():
            self.addAlgorithm(chain)

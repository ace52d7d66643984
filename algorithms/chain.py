"""Models of ``models/`` as tools of the toolbox: chains of Demsmith's tools."""

import glob
import os

from qgis.core import QgsProcessingModelAlgorithm
from qgis.PyQt.QtGui import QIcon

from demsmith.algorithms.provider import ICON, ROOT


def chains():
    """Make a `Chain` of every model that is shipped."""
    return [Chain(path) for path in sorted(glob.glob(os.path.join(ROOT, "models", "*.model3")))]


class Chain(QgsProcessingModelAlgorithm):
    """A shipped model; in the model designer it is opened as any model file.

    Parameters
    ----------
    path : str
        Of the model file, whose name without underscores is the tool's.
    """

    def __init__(self, path):
        super().__init__()
        self._path = path
        # Its tools are looked up again for each run: while the provider loads there are none.
        self.fromFile(path)

    def createInstance(self):
        """Make another of the same model."""
        return Chain(self._path)

    def name(self):
        """Name the tool in ids."""
        return os.path.splitext(os.path.basename(self._path))[0].replace("_", "")

    def groupId(self):
        """Name the tool's group in ids; the file knows its title alone."""
        return "chains"

    def icon(self):
        """Show Demsmith's icon."""
        return QIcon(ICON)

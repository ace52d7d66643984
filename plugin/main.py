"""What QGIS loads: the plugin that brings the Processing provider."""

import os

from qgis.core import Qgis, QgsApplication, QgsMessageLog, QgsSettings
from qgis.PyQt.QtCore import QCoreApplication, QLocale, QTranslator

from demsmith.algorithms import dependencies
from demsmith.algorithms.provider import ROOT, DemsmithProvider


class DemsmithPlugin:
    """The plugin: it adds the provider, says what is missing, and takes the provider away again.

    Parameters
    ----------
    iface : qgis.gui.QgisInterface or None
        QGIS's window; ``None`` in `qgis_process`.
    """

    def __init__(self, iface):
        self._iface = iface
        self._provider = None
        self._drop_handler = None
        self._translator = _translator()

    def initProcessing(self):
        """Add the Processing provider, and let GDAL ask Demsmith for the cells of `.sct` files."""
        dependencies.use_profile_folder()
        self._provider = DemsmithProvider()
        QgsApplication.processingRegistry().addProvider(self._provider)
        if dependencies.python_suffices():
            from demsmith.core.sct import virtual

            virtual.trust()

    def initGui(self):
        """Add the provider and, where a library is missing, say which and how to get it."""
        self.initProcessing()
        self._take_drops()
        problem = dependencies.problem()
        if problem:
            QgsMessageLog.logMessage(problem, "Demsmith", Qgis.MessageLevel.Warning)
            self._iface.messageBar().pushMessage("Demsmith", problem, Qgis.MessageLevel.Warning, 0)

    def unload(self):
        """Take everything away that was added."""
        if self._drop_handler is not None:
            self._drop_handler.cancel()
            self._iface.unregisterCustomDropHandler(self._drop_handler)
            self._drop_handler = None
        if self._provider is not None:
            QgsApplication.processingRegistry().removeProvider(self._provider)
            self._provider = None
            if dependencies.python_suffices():
                from demsmith.core.sct import virtual

                virtual.distrust()
        if self._translator is not None:
            QCoreApplication.removeTranslator(self._translator)
            self._translator = None

    def _take_drops(self):
        """Open `.sct` files that are dropped on the window."""
        from demsmith.plugin.sct_files import SctDropHandler  # needs QGIS's GUI

        self._drop_handler = SctDropHandler(self._iface)
        self._iface.registerCustomDropHandler(self._drop_handler)


def _translator():
    """Install the translation to the user's language, if there is one in ``i18n``."""
    language = QgsSettings().value("locale/userLocale", QLocale().name())
    path = os.path.join(ROOT, "i18n", f"demsmith_{str(language)[:2]}.qm")
    translator = QTranslator()
    if not (os.path.exists(path) and translator.load(path)):
        return None
    QCoreApplication.installTranslator(translator)
    return translator

"""Take the picture of the tool's dialog, in the real QGIS, with the checkout as its plugin.

Run it under a screen, real or Xvfb, as root or not::

    QT_QPA_PLATFORM=xcb xvfb-run -a -s "-screen 0 1280x1024x24" python docs/make_screenshot.py TILE
"""

import os
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TARGET = ROOT / "docs" / "screenshot-dialog.png"


def main(tile):
    """Open the dialog on ``tile`` and save what it shows."""
    home = tempfile.mkdtemp()
    os.environ.update(HOME=home, XDG_RUNTIME_DIR=home, QT_QPA_PLATFORM="xcb", LANG="C.UTF-8")
    from qgis.core import QgsApplication, QgsProject, QgsRasterLayer
    from qgis.PyQt.QtCore import QTimer

    application = QgsApplication([], True)
    application.initQgis()
    sys.path.append(os.path.join(QgsApplication.pkgDataPath(), "python", "plugins"))
    from processing.core.Processing import Processing
    from processing.gui.AlgorithmDialog import AlgorithmDialog

    import demsmith

    Processing.initialize()
    plugin = demsmith.classFactory(None)
    plugin.initProcessing()
    layer = QgsRasterLayer(tile, Path(tile).stem)
    QgsProject.instance().addMapLayer(layer)
    tool = QgsApplication.processingRegistry().createAlgorithmById("demsmith:fillvoids")
    dialog = AlgorithmDialog(tool)
    dialog.resize(1100, 790)
    dialog.show()

    def save():
        dialog.grab().save(str(TARGET))
        dialog.close()
        application.quit()

    QTimer.singleShot(1500, save)
    application.exec()
    QgsProject.instance().clear()
    plugin.unload()
    application.exitQgis()
    shutil.rmtree(home, ignore_errors=True)


if __name__ == "__main__":
    main(sys.argv[1])

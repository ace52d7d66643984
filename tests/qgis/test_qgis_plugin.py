"""The plugin itself: loading, unloading, refusing politely, its manifest and its look."""

import ast
import configparser
import os
import re
import sys
from pathlib import Path

import pytest
from qgis.core import QgsApplication
from qgis.PyQt.QtGui import QImage

import demsmith
from demsmith.algorithms import dependencies
from demsmith.plugin.main import DemsmithPlugin

ROOT = Path(__file__).resolve().parents[2]
LOAD_TIME_FILES = [
    ROOT / "__init__.py", *(ROOT / "plugin").glob("*.py"), *(ROOT / "algorithms").glob("*.py"),
]  # fmt: skip


class _Window:
    """As much of QGIS's window as the plugin touches."""

    def __init__(self):
        self.messages = []
        self.drop_handlers = []

    def registerCustomDropHandler(self, handler):
        self.drop_handlers.append(handler)

    def unregisterCustomDropHandler(self, handler):
        self.drop_handlers.remove(handler)

    def messageBar(self):
        return self

    def pushMessage(self, title, text, level, duration):
        self.messages.append(text)


@pytest.fixture
def registry(plugin):
    """Give Processing's registry without the session's plugin in it."""
    plugin.unload()
    yield QgsApplication.processingRegistry()
    plugin.initProcessing()


def test_loads_and_unloads_in_the_window(registry):
    window = _Window()
    for _ in range(2):
        loaded = demsmith.classFactory(window)
        loaded.initGui()
        provider = registry.providerById("demsmith")
        names = {tool.name() for tool in provider.algorithms()}
        assert names == {
            "compress", "decompress", "drainagearea", "fillvoids", "inverseprocedural",
            "learndictionary", "reconstructfromsamples", "reconstructmosaic", "reconstructsrtm",
            "relief", "solarirradiance", "srtmtodrainageandsun", "thinraster",
            "validatefill",
        }  # fmt: skip
        assert provider.name() == "Demsmith"
        assert provider.longName() != provider.name()
        assert provider.versionInfo() == demsmith.__version__
        assert not provider.icon().isNull()
        assert len(window.drop_handlers) == 1
        loaded.unload()
        assert registry.providerById("demsmith") is None
        assert window.drop_handlers == []
    assert window.messages == []


def test_unload_before_anything_was_loaded(qgis_app):
    DemsmithPlugin(None).unload()


def test_missing_library_is_told_with_the_command(registry, monkeypatch):
    monkeypatch.setattr(dependencies, "REQUIREMENTS", ("numba>=0.59", "no-such-library>=1.2"))
    window = _Window()
    loaded = DemsmithPlugin(window)
    loaded.initGui()
    (message,) = window.messages
    assert "needs no-such-library>=1.2." in message
    assert '-m pip install --upgrade --target "' in message
    assert '"no-such-library>=1.2" "numpy==' in message
    loaded.unload()


def test_old_python_is_refused_politely(registry, monkeypatch):
    monkeypatch.setattr(dependencies, "OLDEST_PYTHON", (9, 1))
    window = _Window()
    loaded = DemsmithPlugin(window)
    loaded.initGui()
    assert registry.providerById("demsmith").algorithms() == []
    (message,) = window.messages
    assert "Python 9.1 or newer" in message
    loaded.unload()


@pytest.mark.parametrize(
    ("installed", "named"),
    [("2.1.3", "numpy==2.1.3"), ("1.24.2", "numpy>=1.26,<2"), ("", "numpy>=1.26")],
)
def test_the_command_keeps_to_the_numpy_of_this_qgis(monkeypatch, installed, named):
    monkeypatch.setattr(dependencies, "_installed", lambda name: installed)
    assert dependencies.install_command(["numba>=0.59"]).endswith(f'"numba>=0.59" "{named}"')


@pytest.mark.parametrize(
    ("version", "fine"), [("0.58.9", False), ("0.59", True), ("0.100.1", True)]
)
def test_versions_are_compared_as_numbers(monkeypatch, version, fine):
    monkeypatch.setattr(dependencies, "REQUIREMENTS", ("numba>=0.59",))
    monkeypatch.setattr(dependencies, "_installed", lambda name: version)
    assert (dependencies.wanting() == []) is fine


def test_libraries_in_the_profile_are_found(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(dependencies, "profile_folder", lambda: str(tmp_path / "missing"))
    dependencies.use_profile_folder()
    assert str(tmp_path / "missing") not in sys.path
    monkeypatch.setattr(dependencies, "profile_folder", lambda: str(tmp_path))
    dependencies.use_profile_folder()
    dependencies.use_profile_folder()
    assert sys.path.count(str(tmp_path)) == 1


def test_the_profile_folder_is_that_of_qpip(qgis_app):
    version = "{}.{}".format(*sys.version_info)
    profile = os.path.normpath(QgsApplication.qgisSettingsDirPath())
    expected = os.path.join(profile, "python", "dependencies", version)
    assert dependencies.profile_folder() == expected


def test_requirements_agree_everywhere():
    listed = (ROOT / "requirements.txt").read_text().split()
    needed = {*dependencies.REQUIREMENTS, *dependencies.EXTRAS}
    assert set(listed) == {each for each in needed if not each.startswith(("numpy", "scipy"))}
    project = (ROOT / "pyproject.toml").read_text()
    for requirement in needed:
        assert f'"{requirement}"' in project


@pytest.mark.parametrize(
    "path", LOAD_TIME_FILES, ids=lambda path: f"{path.parent.name}/{path.name}"
)
def test_load_time_files_parse_on_python_3_9(path):
    ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 9))


def test_load_time_files_import_nothing_heavy_at_the_top():
    allowed = {"qgis", "demsmith", *sys.stdlib_module_names}
    for path in LOAD_TIME_FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [alias.name for alias in getattr(node, "names", [])]
            names = [node.module] if isinstance(node, ast.ImportFrom) else names
            if isinstance(node, ast.Import | ast.ImportFrom):
                assert {name.split(".")[0] for name in names} <= allowed, path
                assert not any(name.startswith("demsmith.core") for name in names), path


def test_manifest_is_what_the_plugin_site_takes():
    manifest = configparser.ConfigParser(interpolation=None)
    manifest.read(ROOT / "metadata.txt", encoding="utf-8")
    general = manifest["general"]
    for key in (
        "name", "description", "version", "qgisMinimumVersion", "author", "email", "about",
        "tracker", "repository", "homepage", "changelog", "tags", "icon", "category",
    ):  # fmt: skip
        assert general[key].strip(), key
    assert general["version"] == demsmith.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", general["version"])
    assert (general["qgisMinimumVersion"], general["qgisMaximumVersion"]) == ("3.22", "4.99")
    assert general["hasProcessingProvider"] == "yes"
    assert general["plugin_dependencies"] == "qpip"
    assert not QImage(str(ROOT / general["icon"])).isNull()

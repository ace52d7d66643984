"""Imports go plugin -> algorithms -> core, the core knows no QGIS, and loading costs nothing."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

import demsmith

ROOT = Path(__file__).resolve().parent.parent
QGIS_LOADS = sorted(
    path.relative_to(ROOT).as_posix()
    for path in [
        ROOT / "__init__.py",
        *ROOT.glob("plugin/**/*.py"),
        *ROOT.glob("algorithms/**/*.py"),
    ]
)

IMPORT_CORE = """
import json, pkgutil, sys

class Forbid:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("qgis", "PyQt5", "PyQt6", "processing"):
            raise RuntimeError("the core imports " + name)

sys.meta_path.insert(0, Forbid())
import demsmith
at_first = sorted(name.split(".")[0] for name in sys.modules)
import demsmith.core
names = [m.name for m in pkgutil.walk_packages(demsmith.core.__path__, "demsmith.core.")]
for name in names:
    __import__(name)
print(json.dumps({"at_first": at_first, "names": names}))
"""


@pytest.fixture(scope="module")
def core_alone():
    """What a fresh Python reports that imports demsmith and all of its core, forbidding QGIS."""
    run = subprocess.run([sys.executable, "-c", IMPORT_CORE], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1])


def test_this_checkout_is_what_is_tested():
    assert Path(demsmith.__file__) == ROOT / "__init__.py", "another copy: run `make clean`"


def test_the_core_loads_without_qgis(core_alone):
    on_disk = {
        ".".join(("demsmith", *path.relative_to(ROOT).with_suffix("").parts))
        for path in ROOT.glob("core/**/*.py")
        if path.name != "__init__.py"
    }
    assert on_disk <= set(core_alone["names"])


def test_importing_demsmith_loads_nothing_heavy(core_alone):
    heavy = {"numpy", "numba", "scipy", "osgeo", "cyclopts", "rich", "geographiclib"}
    assert not heavy & set(core_alone["at_first"])


def test_import_contracts():
    run = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-logo", "--no-cache"],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    assert "0 broken" in run.stdout


@pytest.mark.parametrize("file", QGIS_LOADS)
def test_what_qgis_loads_parses_on_python_3_9(file):
    ast.parse((ROOT / file).read_text(encoding="utf-8"), filename=file, feature_version=(3, 9))

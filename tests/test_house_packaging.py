"""What is shipped is whole: the wheel for Python, the zip for QGIS's plugin site."""

import configparser
import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import demsmith

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MAX_ZIP_BYTES = 25_000_000  # the plugin site's limit
NOT_FOR_QGIS = {
    ".ci", ".flake8", ".git", ".gitattributes", ".gitignore", ".venv", "Makefile", "benchmarks",
    "build", "demo", "dist", "pyproject.toml", "shared", "tests", "tools",
}  # fmt: skip
BINARIES = {
    ".a", ".dll", ".dylib", ".exe", ".jar", ".lib", ".o", ".pyc", ".pyd", ".pyo", ".so", ".whl",
}  # fmt: skip
REQUIRED_KEYS = {
    "name", "description", "version", "qgisMinimumVersion", "author", "email", "about", "tracker",
    "repository", "homepage",
}  # fmt: skip
RECOMMENDED_KEYS = {"changelog", "tags", "icon", "category", "hasProcessingProvider"}


def run(command, **options):
    """Run a command of words; fail with what it said."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, **options
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def git(tmp_path_factory):
    """The environment in which git sees the working tree as it is, and writes to a folder aside."""
    if not (ROOT / ".git").exists() or not shutil.which("git"):
        pytest.skip("this is no git checkout, which the zip and the wheel's file list need")
    aside = tmp_path_factory.mktemp("git")
    return os.environ | {
        "GIT_DIR": str(ROOT / ".git"),
        "GIT_WORK_TREE": str(ROOT),
        "GIT_INDEX_FILE": str(aside / "index"),
        "GIT_OBJECT_DIRECTORY": str(aside),
        "GIT_ALTERNATE_OBJECT_DIRECTORIES": str(ROOT / ".git" / "objects"),
        "GIT_CONFIG_COUNT": "1",  # the run's own HOME hides the user's safe.directory
        "GIT_CONFIG_KEY_0": "safe.directory",
        "GIT_CONFIG_VALUE_0": "*",
    }


@pytest.fixture(scope="module")
def files(git):
    """Every file git has or would take, relative to the root."""
    listed = run(["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT, env=git)
    return sorted({name for name in listed.split("\0") if name and (ROOT / name).is_file()})


# --- the wheel ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def wheel(files, tmp_path_factory):
    """The wheel, made from a copy: a build leaves folders that later builds would pick up."""
    folder = tmp_path_factory.mktemp("wheel")
    for name in files:
        (folder / "source" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / "source" / name)
    run([
        sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-index", "--no-build-isolation",
        "--wheel-dir", folder, folder / "source",
    ])  # fmt: skip
    return next(folder.glob("demsmith-*.whl"))


def test_wheel_holds_every_module(wheel, files):
    tops = {"__init__.py", "plugin", "algorithms", "core"}
    modules = {n for n in files if n.endswith(".py") and n.split("/")[0] in tops}
    names = zipfile.ZipFile(wheel).namelist()
    shipped = {n.removeprefix("demsmith/") for n in names if n.endswith(".py")}
    assert shipped == modules


def test_wheel_imports_away_from_the_checkout(wheel, tmp_path):
    zipfile.ZipFile(wheel).extractall(tmp_path)
    script = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import demsmith, demsmith.core.cli\n"
        "print(demsmith.__file__, demsmith.core.cli.__file__)"
    )
    for path in run([sys.executable, "-c", script, tmp_path], cwd=tmp_path).split():
        assert Path(path).is_relative_to(tmp_path)


def test_wheel_carries_licence_and_version(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert wheel.name.startswith(f"demsmith-{demsmith.__version__}-")


def test_every_requirement_has_a_lower_bound():
    extras = PROJECT["optional-dependencies"].values()
    for line in [*PROJECT["dependencies"], *(line for extra in extras for line in extra)]:
        requirement = Requirement(line)
        lower = {s.operator for s in requirement.specifier} & {">=", ">", "==", "~="}
        assert lower or requirement.name == "demsmith", line


def test_requirements_for_qgis_agree_with_the_package():
    file = ROOT / "requirements.txt"
    lines = [line.split("#")[0].strip() for line in file.read_text(encoding="utf-8").splitlines()]
    for_qgis = {r.name.lower(): r.specifier for r in map(Requirement, filter(None, lines))}
    of_package = {r.name: r.specifier for r in map(Requirement, PROJECT["dependencies"])}
    assert not {"numpy", "scipy", "gdal"} & for_qgis.keys(), "QGIS brings its own; never move them"
    for name, specifier in for_qgis.items():
        assert specifier == of_package.get(name, specifier), name


# --- the plugin's zip --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def zip_file(git, tmp_path_factory):
    """The zip `make zip` gives once the working tree is committed."""
    folder = tmp_path_factory.mktemp("zip")
    run(["git", "add", "--all"], cwd=ROOT, env=git)
    tree = run(["git", "write-tree"], cwd=ROOT, env=git).strip()
    run(["make", "zip", f"REVISION={tree}", f"DIST={folder}"], cwd=ROOT, env=git)
    return next(folder.glob("demsmith-*.zip"))


@pytest.fixture(scope="module")
def unpacked(zip_file, tmp_path_factory):
    folder = tmp_path_factory.mktemp("unpacked")
    zipfile.ZipFile(zip_file).extractall(folder)
    return folder / "demsmith"


@pytest.fixture(scope="module")
def metadata(unpacked):
    parser = configparser.ConfigParser(interpolation=None)
    parser.optionxform = str
    parser.read_string((unpacked / "metadata.txt").read_text(encoding="utf-8"))
    return parser["general"]


def test_zip_has_one_folder_and_what_the_site_asks_for(zip_file):
    names = zipfile.ZipFile(zip_file).namelist()
    assert {name.split("/")[0] for name in names} == {"demsmith"}
    assert {"demsmith/__init__.py", "demsmith/metadata.txt", "demsmith/LICENSE"} <= set(names)


def test_zip_holds_no_more_than_qgis_needs(zip_file):
    names = zipfile.ZipFile(zip_file).namelist()
    assert not {name.split("/")[1] for name in names} & NOT_FOR_QGIS
    assert not [name for name in names if "__pycache__" in name or Path(name).suffix in BINARIES]


def test_zip_holds_all_code(zip_file, files):
    shipped = set(zipfile.ZipFile(zip_file).namelist())
    code = [n for n in files if n.split("/")[0] in {"plugin", "algorithms", "core", "styles"}]
    assert not [name for name in code if f"demsmith/{name}" not in shipped]


def test_zip_is_small_and_called_by_its_version(zip_file):
    assert zip_file.stat().st_size < MAX_ZIP_BYTES
    assert zip_file.name == f"demsmith-{demsmith.__version__}.zip"


def test_metadata_says_all_the_site_asks_for(metadata):
    empty = {key for key in REQUIRED_KEYS | RECOMMENDED_KEYS if not metadata.get(key, "").strip()}
    assert not empty
    assert metadata["category"] == "Raster"
    assert metadata["hasProcessingProvider"] == "yes"
    assert metadata["qgisMinimumVersion"] == "3.22"
    assert metadata["qgisMaximumVersion"] == "4.99"


def test_metadata_icon_is_in_the_zip(metadata, unpacked):
    assert (unpacked / metadata["icon"]).is_file()


def test_metadata_version_is_the_package_version(metadata):
    assert metadata["version"] == demsmith.__version__


def test_bandit_finds_nothing(unpacked):
    found = subprocess.run(
        [sys.executable, "-m", "bandit", "-r", "-f", "json", "-q", unpacked],
        capture_output=True, text=True,
    )  # fmt: skip
    report = json.loads(found.stdout)
    assert report["metrics"]["_totals"]["loc"] > 0
    assert not [f"{r['filename']}:{r['line_number']} {r['issue_text']}" for r in report["results"]]


def test_detect_secrets_finds_nothing(unpacked):
    report = json.loads(run([
        Path(sys.executable).with_name("detect-secrets"), "scan", "--all-files", "."
    ], cwd=unpacked))  # fmt: skip
    assert report["results"] == {}

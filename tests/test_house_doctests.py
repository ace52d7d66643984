"""The examples in docstrings print what they say."""

import doctest
import importlib
import pkgutil

import pytest

import demsmith

MODULES = ["demsmith"] + [
    module.name for module in pkgutil.walk_packages(demsmith.__path__, "demsmith.")
]
OTHERS = {"qgis", "processing", "osgeo"}  # may be missing here; all else must be importable


@pytest.mark.parametrize("name", MODULES)
def test_docstring_examples(name):
    try:
        module = importlib.import_module(name)
    except ImportError as error:
        if (error.name or "").split(".")[0] in OTHERS:
            pytest.skip(f"{error.name} is not installed")
        raise
    failed, tried = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert not failed, f"{failed} of {tried} examples failed, see the output above"

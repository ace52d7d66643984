"""Help, version and bad usage; and that the command line has the core's options, all of them."""

import importlib
import inspect
import re
import types

import pytest

import demsmith as package
from demsmith.core.cli import main
from demsmith.core.mcmd import MapFiles
from demsmith.core.options import specifications
from demsmith.core.voids import FillOptions, fill_file

SPECS = specifications(FillOptions)
MAPS = specifications(MapFiles)
SHARED = (
    "--band", "--nodata", "--below", "--above", "--mask", "--seed", "--threads", "--json",
    "--quiet", "--overwrite", "--creation-option",
)  # fmt: skip


def word_of(spec):
    return "--" + (spec.flag or spec.name).replace("_", "-")


def other_value(spec):
    """Give a value that is not the default, where there is another."""
    if spec.kind is bool:
        return not spec.default
    if spec.choices:
        return spec.choices[-1]
    low = -1000 if spec.minimum is None else spec.minimum
    high = low + 1000 if spec.maximum is None else spec.maximum
    return spec.kind(low + (high - low) / 4)


@pytest.fixture
def fill_call(monkeypatch):
    """Call `demsmith fill` with no work behind it; returns the arguments `fill_file` was given."""
    given = {}

    def stand_in(*paths, **arguments):
        names = list(inspect.signature(fill_file).parameters)
        given.update(zip(names, paths, strict=False), **arguments)
        return types.SimpleNamespace(
            voids=1, cells_filled=2, cells_unfilled=0, largest_void=2, seconds=0.1,
            output=paths[1], tuning=None, warnings=(), as_dict=dict,
        )  # fmt: skip

    monkeypatch.setattr(importlib.import_module("demsmith.core.cli.fill"), "fill_file", stand_in)

    def call(*words):
        given.clear()
        assert main(["fill", "in.tif", "out.tif", *map(str, words)]) == 0
        return dict(given)

    return call


@pytest.fixture
def fill_help(demsmith, monkeypatch):
    """Entries of `demsmith fill --help` by their first word."""
    monkeypatch.setenv("COLUMNS", "1000")
    status, out, err = demsmith("fill", "--help")
    assert (status, err) == (0, "")
    return {
        match[1]: " ".join(line.split())
        for line in out.splitlines()
        if (match := re.match(r"│ \*? *(--[a-z-]+|[A-Z]+) ", line))
    }


def test_version(demsmith):
    assert demsmith("--version") == (0, f"demsmith {package.__version__}\n", "")


@pytest.mark.parametrize("words", [(), ("--help",), ("-h",)])
def test_help_lists_the_verbs(demsmith, words):
    status, out, err = demsmith(*words)
    assert (status, err) == (0, "")
    assert re.search(r"fill +Fill the voids", out)


def test_help_names_the_voids(demsmith):
    out = demsmith("fill", "--help").out
    assert "-32768" in out
    assert "demsmith fill N42E001.hgt filled.tif" in out


@pytest.mark.parametrize("spec", [*SPECS, *MAPS], ids=lambda spec: spec.name)
def test_help_of_every_option(fill_help, spec):
    entry = fill_help[word_of(spec)]
    assert spec.help in entry
    if spec.kind is not bool and spec.default is not None:
        assert f"[default: {spec.default}]" in entry
    for bound in (spec.minimum, spec.maximum):
        if bound is not None:
            assert f"{bound:.10g}" in entry
    for choice in spec.choices:
        assert choice in entry.partition("[choices:")[2]


def test_help_has_nothing_that_nobody_defined(fill_help):
    ours = {word_of(spec) for spec in [*SPECS, *MAPS]}
    assert set(fill_help) == {
        *ours, *SHARED, "INPUT", "OUTPUT", "--source-map", "--uncertainty", "--report",
    }  # fmt: skip


def test_mcmd_options_have_a_group_of_their_own(demsmith):
    common, mcmd = demsmith("fill", "--help").out.split("─ MCMD ─")
    for spec in [*SPECS, *MAPS]:
        assert f" {word_of(spec)} " in (mcmd if spec.advanced else common)


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.name)
def test_every_option_reaches_the_fill(fill_call, spec):
    value = other_value(spec)
    words = [word_of(spec)] if spec.kind is bool else [word_of(spec), value]
    options = fill_call(*words)["options"]
    assert isinstance(options, FillOptions)
    assert getattr(options, spec.name) == value
    for other in SPECS:
        if other.name != spec.name:
            assert getattr(options, other.name) == other.default


@pytest.mark.parametrize("spec", MAPS, ids=lambda spec: spec.name)
def test_every_map_reaches_the_fill(fill_call, spec):
    name = spec.name.removesuffix("_map")
    assert fill_call(word_of(spec), "m.tif")["maps"] == {name: "m.tif"}


def test_every_parameter_of_the_fill_is_reached(fill_call):
    given = fill_call(
        "--band", 2, "--nodata", -9999, "--below", -500, "--above", 9000, "--mask", "m.tif",
        "--source-map", "s.tif", "--uncertainty", "u.tif", "--report", "r.json", "--threads", 3,
        "--overwrite",
        "--creation-option", "COMPRESS=LZW", "--creation-option", "TILED=NO",
        "--h-map", "h.tif", "--r-s-map", "r.tif",
    )  # fmt: skip
    assert set(given) == set(inspect.signature(fill_file).parameters)
    del given["options"], given["progress"]
    assert given == dict(
        input="in.tif", output="out.tif", maps={"h": "h.tif", "r_s": "r.tif"}, band=2,
        nodata=(-9999.0,), below=-500.0, above=9000.0, mask="m.tif",
        source_map="s.tif", uncertainty="u.tif", report="r.json", threads=3, overwrite=True,
        creation_options=("COMPRESS=LZW", "TILED=NO"),
    )  # fmt: skip


def test_defaults_are_those_of_the_fill(fill_call):
    given = fill_call()
    assert given["options"] == type(given["options"])()
    assert given["maps"] == {}
    for name, parameter in inspect.signature(fill_file).parameters.items():
        if name not in ("input", "output", "options", "maps", "progress"):
            assert given[name] == parameter.default


@pytest.mark.parametrize(
    ("words", "values"),
    [
        (["--nodata", "-9999"], (-9999,)),
        (["--nodata=-9999"], (-9999,)),
        (["--nodata", "-9999,-32768"], (-9999, -32768)),
        (["--nodata", "0, 1e3"], (0, 1000)),
        (["--nodata", "0", "--nodata", "-1.5,2"], (0, -1.5, 2)),
    ],
)
def test_nodata_values(fill_call, words, values):
    assert fill_call(*words)["nodata"] == values


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fill"], "INPUT"),
        (["fill", "a.tif"], "OUTPUT"),
        (["fill", "a.tif", "b.tif", "c.tif"], "c.tif"),
        (["fill", "a.tif", "b.tif", "--roughness", "1"], "--roughness"),
        (["fill", "a.tif", "b.tif", "--band", "x"], "--band"),
        (["fill", "a.tif", "b.tif", "--band"], "--band"),
        (["fill", "a.tif", "b.tif", "--nodata", "none"], "'none' is not a number"),
        (["fill", "a.tif", "b.tif", "--nodata", "--json"], "'--json' is not a number"),
        (["fill", "a.tif", "b.tif", "--method", "magic"], "magic"),
        (["fill", "a.tif", "b.tif", "--variant", "magic"], "relaxed"),
        (["fill", "a.tif", "b.tif", "--h", "1.5"], "h is 1.5; it must be at most 1"),
        (["fill", "a.tif", "b.tif", "--h", "nan"], "finite"),
        (["fill", "a.tif", "b.tif", "--max-size", "0"], "at least 1"),
        (["fill", "a.tif", "b.tif", "--seed", "-1"], "at least 0"),
        (["fell", "a.tif", "b.tif"], 'Did you mean "fill"'),
        (["--roughness"], "--roughness"),
    ],
)
def test_bad_usage(demsmith, words, said):
    status, out, err = demsmith(*words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert "Traceback" not in err

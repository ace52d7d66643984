"""From file to file: all outputs or none, refusals, progress, threads."""

import os
from pathlib import Path

import numpy as np
import pytest
from support import digest, make_raster
from void_files import tile

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.voids import FillOptions, fill_file, job

OUTPUTS = ("out.tif", "map.tif", "sigma.tif", "report.json")


def outputs(folder):
    return dict(
        output=folder / "out.tif", source_map=folder / "map.tif", uncertainty=folder / "sigma.tif",
        report=folder / "report.json",
    )  # fmt: skip


def listing(folder):
    return {path.name: digest(path) for path in Path(folder).rglob("*") if path.is_file()}


def fail_at(monkeypatch, module, name, call):
    """Make the ``call``-th call of a function of the job fail."""
    real, calls = getattr(module, name), []

    def failing(*args, **kwargs):
        calls.append(1)
        if len(calls) == call:
            raise OutputError("the disk is full")
        return real(*args, **kwargs)

    monkeypatch.setattr(module, name, failing)


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize(
    "where", ["write 1", "write 2", "write 3", "report", "cancel", "creation option"]
)
def test_all_outputs_or_none(tmp_path, monkeypatch, where, older):
    source = tile(tmp_path / "in.tif")
    folder = tmp_path / "out"
    folder.mkdir()
    if older:
        for name in OUTPUTS:
            (folder / name).write_bytes(b"older " + name.encode())
    before = listing(tmp_path)
    options, error = {}, OutputError
    if where.startswith("write"):
        fail_at(monkeypatch, raster, "write", int(where[-1]))
    elif where == "report":
        fail_at(monkeypatch, job, "_write_report", 1)
    elif where == "creation option":
        options, error = dict(creation_options=["COMPRESS=JPEG2001"]), (InputError, OutputError)
    else:
        options, error = dict(progress=StopAtTheEnd()), Cancelled
    with pytest.raises(error):
        fill_file(source, **outputs(folder), overwrite=older, **options)
    assert listing(tmp_path) == before
    assert sorted(os.listdir(folder)) == (sorted(OUTPUTS) if older else [])


class StopAtTheEnd:
    last = 0

    def report(self, fraction):
        self.last = fraction

    def cancelled(self):
        return self.last >= 0.97


@pytest.mark.parametrize("taken", OUTPUTS)
def test_nothing_is_overwritten_unasked(tmp_path, taken):
    source = tile(tmp_path / "in.tif")
    (tmp_path / taken).write_bytes(b"mine")
    before = listing(tmp_path)
    with pytest.raises(OutputError, match="exists already"):
        fill_file(source, **outputs(tmp_path))
    assert listing(tmp_path) == before
    fill_file(source, **outputs(tmp_path), overwrite=True)
    assert digest(tmp_path / taken) != before[taken]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(output="in.tif"), "is an input"),
        (dict(source_map="in.tif"), "is an input"),
        (dict(report="in.tif"), "is an input"),
        (dict(source_map="out.tif"), "different files"),
        (dict(report="map.tif"), "different files"),
        (dict(uncertainty="in.tif"), "is an input"),
        (dict(uncertainty="map.tif"), "different files"),
        (dict(uncertainty="missing/s.tif"), "no folder"),
        (dict(options=FillOptions(method="mcmd")), "an uncertainty needs the method auto"),
        (dict(options=FillOptions(r_s=0.1)), "an uncertainty needs the method auto"),
        (dict(options=FillOptions(tune=True)), "an uncertainty needs the method auto"),
        (dict(output="out.png"), "must be a GeoTIFF"),
        (dict(output="missing/out.tif"), "no folder"),
        (dict(report="missing/r.json"), "no folder"),
        (dict(band=2), "band"),
        (dict(threads=0), "threads"),
        (dict(options=FillOptions(h=7)), "h is 7"),
        (dict(options=FillOptions(l=1.0), uncertainty=None), "relaxed"),
        (
            dict(options=FillOptions(variant="paper", datum=1e5), uncertainty=None),
            r"in\.tif.*datum",
        ),
    ],
)
def test_refused_without_a_trace(tmp_path, changes, message):
    source = tile(tmp_path / "in.tif")
    before = listing(tmp_path)
    asked = outputs(tmp_path)
    for name, value in changes.items():
        asked[name] = tmp_path / value if name in asked and value else value
    with pytest.raises((InputError, OutputError), match=message):
        fill_file(source, **asked, overwrite=True)
    assert listing(tmp_path) == before


def test_all_void_is_refused(tmp_path):
    source = make_raster(tmp_path / "in.tif", np.full((5, 6), -1, np.int16), nodata=-1)
    with pytest.raises(InputError, match=r"in\.tif.*every cell is a void"):
        fill_file(source, tmp_path / "out.tif")
    assert not (tmp_path / "out.tif").exists()


def test_progress_of_the_whole_job(tmp_path):
    fractions = []

    class Show:
        def report(self, fraction):
            fractions.append(fraction)

        def cancelled(self):
            return False

    fill_file(tile(tmp_path / "in.tif"), **outputs(tmp_path), progress=Show())
    assert (np.diff(fractions) >= 0).all()
    assert fractions[0] >= 0 and fractions[-1] == 1


@pytest.mark.parametrize(
    "options", [{}, dict(variant="relaxed", r_s=0.1), dict(variant="paper", r_s=0.1)]
)
def test_outputs_do_not_depend_on_threads(tmp_path, options):
    source = tile(tmp_path / "in.tif")
    names = ("output", "source_map") if options else ("output", "source_map", "uncertainty")
    for threads in (1, 2, 5):
        paths = {name: tmp_path / f"{threads}{name}.tif" for name in names}
        fill_file(source, **paths, threads=threads, options=FillOptions(**options))
    for name in names:
        assert len({digest(tmp_path / f"{threads}{name}.tif") for threads in (1, 2, 5)}) == 1

"""Mosaics: the bytes of the merged raster, whatever the tiles, workers and interruptions."""

import json
import os
import tracemalloc

import numpy as np
import pytest
from scenes import fractal
from support import WGS84_3ARC, digest, make_raster, shared_data

import demsmith
from demsmith.core import raster
from demsmith.core.errors import Cancelled, DemsmithError, InputError, OutputError
from demsmith.core.mosaic import tasks
from demsmith.core.mosaic.layout import LARGEST_TILE, chunk_side
from demsmith.core.mosaic.schedulers import InThisProcess, Processes, StopFile, Task
from demsmith.core.mosaic.workplace import NAME, Workplace, whole
from demsmith.core.reconstruction import ReconstructOptions
from demsmith.core.voids.sources import FILLED, NEIGHBOUR

SHAPE = (161, 181)
GRID = raster.Grid(SHAPE, WGS84_3ARC, "EPSG:4326")
OPTIONS = ReconstructOptions(method="mcmd", float_output=True, noisy_rims=True)
QUARTERS = {"nw": (0, 80, 0, 90), "ne": (0, 80, 90, 181), "sw": (80, 161, 0, 90),
            "se": (80, 161, 90, 181)}  # fmt: skip


def scene():
    """Ground with voids of many sizes: over the corner of four quarters, their edges, the rim."""
    ground = fractal((257, 257), seed=4)[: SHAPE[0], : SHAPE[1]].astype(np.int16)
    rng = np.random.default_rng(1)
    void = rng.random(SHAPE) < 0.01
    for top, bottom, left, right in (
        (70, 95, 80, 100), (20, 60, 88, 92), (76, 84, 10, 40), (0, 9, 150, 160), (120, 161, 0, 6),
    ):  # fmt: skip
        void[top:bottom, left:right] = True
    ground[130, 89] += 3000  # a spike on the seam of two tiles
    ground[void] = -32768
    return ground


def cut(folder, ground, boxes=None, *, shared=0, **how):
    """Write tiles; ``shared`` rows and columns more to the south and east."""
    folder.mkdir(exist_ok=True)
    for name, (top, bottom, left, right) in (boxes or QUARTERS).items():
        rows = slice(top, min(bottom + shared, SHAPE[0]))
        columns = slice(left, min(right + shared, SHAPE[1]))
        geotransform = GRID.part(rows, columns).geotransform
        given = dict(geotransform=geotransform, nodata=-32768) | how
        make_raster(folder / f"{name}.tif", ground[rows, columns], **given)
    return folder


@pytest.fixture(scope="module")
def merged(tmp_path_factory):
    """What the merged raster becomes: values, sources."""
    folder = tmp_path_factory.mktemp("merged")
    path = make_raster(folder / "all.tif", scene(), nodata=-32768)
    result = demsmith.reconstruct_file(
        path, folder / "out.tif", options=OPTIONS, source_map=folder / "source.tif"
    )
    return raster.read(result.output).values, raster.read(folder / "source.tif").values


def assert_is_part(path, whole, box):
    found = raster.read(path).values
    top, _, left, _ = box
    height, width = found.shape
    np.testing.assert_array_equal(found, whole[top : top + height, left : left + width])


@pytest.mark.parametrize("shared", [0, 1, 5])
def test_tiles_hold_what_the_merged_raster_would(tmp_path, merged, shared):
    tiles = cut(tmp_path / "tiles", scene(), shared=shared)
    result = demsmith.reconstruct_mosaic(
        tiles, tmp_path / "out", options=OPTIONS, workers=0, source_map=True
    )
    for name, box in QUARTERS.items():
        assert_is_part(tmp_path / "out" / f"{name}.tif", merged[0], box)
        assert_is_part(tmp_path / "out" / f"{name}_source.tif", merged[1], box)
    np.testing.assert_array_equal(raster.read(result.vrt).values, merged[0])
    assert result.cells_unfilled == 0
    assert result.cells_faulty > 0
    assert result.voids == result.table.cells.size > 50
    assert not os.path.exists(tmp_path / "out" / NAME)


def test_other_cuts_give_the_same(tmp_path, merged):
    strips = {f"s{row:03}": (row, min(row + 23, 161), 0, 181) for row in range(0, 161, 23)}
    tiles = cut(tmp_path / "tiles", scene(), strips)
    demsmith.reconstruct_mosaic(tiles, tmp_path / "out", options=OPTIONS, workers=0, threads=1)
    for name, box in strips.items():
        assert_is_part(tmp_path / "out" / f"{name}.tif", merged[0], box)


def test_any_number_of_workers_gives_the_same_bytes(tmp_path):
    tiles = cut(tmp_path / "tiles", scene(), shared=1)
    for workers in (0, 1, 3):
        demsmith.reconstruct_mosaic(
            tiles, tmp_path / f"out{workers}", options=OPTIONS, workers=workers, source_map=True
        )
    names = sorted(path.name for path in (tmp_path / "out0").glob("*.tif"))
    assert len(names) == 8
    for name in names:
        first, *others = (digest(tmp_path / f"out{workers}" / name) for workers in (0, 1, 3))
        assert others == [first, first]


def test_accurate_engine_in_tiles_is_that_of_the_merged_raster(tmp_path):
    accurate = ReconstructOptions(float_output=True)
    whole = make_raster(tmp_path / "all.tif", scene(), nodata=-32768)
    aux = make_raster(tmp_path / "aux.tif", fractal((257, 257), seed=4)[:161, :181] + 3.0)
    paths = dict(source_map=tmp_path / "source.tif", uncertainty=tmp_path / "sigma.tif")
    demsmith.reconstruct_file(
        whole, tmp_path / "out.tif", options=accurate, auxiliaries=[aux], **paths
    )
    tiles = cut(tmp_path / "tiles", scene(), shared=1)
    demsmith.reconstruct_mosaic(
        tiles, tmp_path / "out", options=accurate, auxiliaries=[aux], workers=0, source_map=True,
        uncertainty=True,
    )  # fmt: skip
    for suffix, path in (("", "out.tif"), ("_source", "source.tif"), ("_uncertainty", "sigma.tif")):
        for name, box in QUARTERS.items():
            expected = raster.read(tmp_path / path).values
            assert_is_part(tmp_path / "out" / f"{name}{suffix}.tif", expected, box)


def test_real_neighbours_are_as_merged(tmp_path):
    paths = [shared_data("pyrenees_raw/N42E001.hgt"), shared_data("catalonia_raw/N41E001.hgt")]
    north, south = (raster.read(path) for path in paths)
    values = np.concatenate([north.values, south.values[1:]])
    geotransform = north.grid.geotransform
    whole = make_raster(tmp_path / "all.tif", values, geotransform=geotransform, nodata=-32768)
    options = ReconstructOptions(method="mcmd")
    demsmith.reconstruct_file(whole, tmp_path / "merged.tif", options=options)
    demsmith.reconstruct_mosaic(paths, tmp_path / "out", options=options, workers=0)
    merged = raster.read(tmp_path / "merged.tif").values
    np.testing.assert_array_equal(raster.read(tmp_path / "out/N42E001.tif").values, merged[:1201])
    np.testing.assert_array_equal(raster.read(tmp_path / "out/N41E001.tif").values, merged[1200:])


def test_gaps_stay_gaps(tmp_path):
    boxes = {name: QUARTERS[name] for name in ("nw", "se")}
    tiles = cut(tmp_path / "tiles", scene(), boxes)
    result = demsmith.reconstruct_mosaic(tiles, tmp_path / "out", options=OPTIONS, workers=0)
    assert sorted(path.name for path in (tmp_path / "out").glob("*.tif")) == ["nw.tif", "se.tif"]
    assert result.cells_unfilled == 0
    # The corner's void is two here, each of which reaches the edge of what there is.
    table = result.table
    corner = (table.row == 70) & (table.column == 80)
    assert table.touches_edge[corner].all()
    assert raster.read(result.vrt).void[:80, 90:].all()


def test_tiles_that_disagree_are_brought_together_and_told(tmp_path):
    ground = scene()
    tiles = cut(tmp_path / "tiles", ground, {"a": QUARTERS["nw"]}, shared=1)
    other = ground.copy()
    other[:80, 90][ground[:80, 90] != -32768] += 1
    cut(tiles, other, {"b": QUARTERS["ne"]})
    result = demsmith.reconstruct_mosaic(
        tiles, tmp_path / "out", options=OPTIONS, workers=0, source_map=True
    )
    a, b = (raster.read(tmp_path / "out" / f"{name}.tif").values for name in "ab")
    np.testing.assert_array_equal(a[:80, 90], b[:, 0])
    (told,) = result.warnings
    assert "b.tif" in told and "known otherwise" in told
    sources = raster.read(tmp_path / "out/b_source.tif").values
    assert set(np.unique(sources[:, 0])) == {FILLED, NEIGHBOUR}
    assert result.tiles[1]["cells_replaced"] == (sources[:, 0] == NEIGHBOUR).sum()


def test_tiles_of_several_types(tmp_path):
    ground = scene()
    tiles = cut(tmp_path / "tiles", ground, {"a": QUARTERS["nw"]})
    cut(tiles, ground.astype(np.float32), {"b": QUARTERS["ne"]})
    options = ReconstructOptions(method="mcmd")
    result = demsmith.reconstruct_mosaic(tiles, tmp_path / "out", options=options, workers=0)
    types = [raster.read(tmp_path / "out" / f"{name}.tif").values.dtype for name in "ab"]
    assert types == [np.int16, np.float32]
    assert result.vrt is None
    assert "mosaic.vrt" in result.warnings[-1]


def test_summaries(tmp_path):
    ogr = pytest.importorskip("osgeo.ogr", reason="GDAL is missing")
    tiles = cut(tmp_path / "tiles", scene())
    result = demsmith.reconstruct_mosaic(
        tiles, tmp_path / "out", options=OPTIONS, workers=0, voids_layer=True
    )
    told = json.loads((tmp_path / "out/mosaic.json").read_text())
    assert [os.path.basename(tile["output"]) for tile in told["tiles"]] == [
        "ne.tif", "nw.tif", "se.tif", "sw.tif",
    ]  # fmt: skip
    assert len(told["void_table"]) == result.voids
    assert "<img" in (tmp_path / "out/mosaic.html").read_text()
    layer = ogr.Open(result.voids_layer)
    assert layer.GetLayer(0).GetFeatureCount() == result.voids
    assert json.loads(json.dumps(result.as_dict()))["cells_filled"] == result.cells_filled


def test_a_stopped_run_goes_on_where_it_was(tmp_path, monkeypatch, merged):
    tiles = cut(tmp_path / "tiles", scene())
    done = []

    def counted(name, dies_at=None):
        real = getattr(tasks, name)

        def task(*args, **how):
            if len(done) == dies_at:
                raise MemoryError("as if killed")
            done.append(name)
            real(*args, **how)

        monkeypatch.setattr(tasks, name, task)

    def run():
        return demsmith.reconstruct_mosaic(tiles, tmp_path / "out", options=OPTIONS, workers=0)

    for name in ("survey", "scan", "fill"):
        counted(name)
    with monkeypatch.context() as dying:
        real = tasks.write
        dying.setattr(
            tasks, "write",
            lambda *args, **how: (
                real(*args, **how) if not args[-1].endswith("tile-2.json") else _fail()
            ),
        )  # fmt: skip
        with pytest.raises(MemoryError):
            run()
    assert {"survey", "scan", "fill"} == set(done)
    written = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("*.tif")}
    assert len(written) == 2
    done.clear()
    run()
    assert done == []
    for name, time in written.items():
        assert (tmp_path / "out" / name).stat().st_mtime_ns == time
    for name, box in QUARTERS.items():
        assert_is_part(tmp_path / "out" / f"{name}.tif", merged[0], box)


def _fail():
    raise MemoryError("as if killed")


def test_a_changed_tile_or_option_starts_anew(tmp_path):
    facts = {"tiles": [1], "options": "a"}
    first = Workplace(str(tmp_path), facts)
    first.open()
    with whole(first.path("result")) as file:
        file.write(b"1")
    again = Workplace(str(tmp_path), facts)
    again.open()
    assert again.resumed
    assert os.path.exists(again.path("result"))
    other = Workplace(str(tmp_path), {**facts, "options": "b"})
    other.open()
    assert not other.resumed
    assert not os.path.exists(other.path("result"))


def test_a_result_is_whole_or_not_there(tmp_path):
    def begin():
        with whole(tmp_path / "result") as file:
            file.write(b"half")
            raise ValueError("half")

    with pytest.raises(ValueError, match="half"):
        begin()
    assert os.listdir(tmp_path) == []


def _die_once(path, *, threads, progress):
    """Kill this worker the first time, as the kernel does for want of memory."""
    mark = path + ".died"
    if not os.path.exists(mark):
        open(mark, "wb").close()
        os.kill(os.getpid(), 9)
    with whole(path) as file:
        file.write(b"done")


def _die(path, *, threads, progress):
    os.kill(os.getpid(), 9)


def _refuse(path, *, threads, progress):
    raise InputError(f"'{path}' is bad")


def _task(function, path):
    return Task(os.path.basename(path), function, (str(path),), str(path))


class Silent:
    def report(self, fraction):
        pass

    def cancelled(self):
        return False


def test_a_workers_death_costs_only_its_task(tmp_path):
    wanted = [_task(_die_once, tmp_path / f"{n}") for n in range(3)]
    with Processes(2) as crew:
        crew.run(wanted, stop=StopFile(str(tmp_path / "stop")), progress=Silent())
    assert all(os.path.exists(task.result) for task in wanted)


def test_a_task_that_kills_again_and_again_is_given_up(tmp_path):
    with Processes(1) as crew, pytest.raises(DemsmithError, match="died at evil"):
        crew.run(
            [_task(_die, tmp_path / "evil")], stop=StopFile(str(tmp_path / "stop")),
            progress=Silent(),
        )  # fmt: skip


def test_an_error_of_a_worker_is_told_as_it_is(tmp_path):
    stop = StopFile(str(tmp_path / "stop"))
    with Processes(2) as crew, pytest.raises(InputError, match="bad' is bad"):
        crew.run([_task(_refuse, tmp_path / "bad")], stop=stop, progress=Silent())
    assert StopFile(str(tmp_path / "stop")).cancelled()


def test_cancel_keeps_what_is_done(tmp_path, merged):
    class Late(Silent):
        fraction = 0

        def report(self, fraction):
            self.fraction = fraction

        def cancelled(self):
            return self.fraction > 0.85

    tiles = cut(tmp_path / "tiles", scene())
    with pytest.raises(Cancelled, match="the same command goes on"):
        demsmith.reconstruct_mosaic(
            tiles, tmp_path / "out", options=OPTIONS, workers=0, progress=Late()
        )
    for path in (tmp_path / "out").glob("*.tif"):
        assert_is_part(path, merged[0], QUARTERS[path.stem])
    demsmith.reconstruct_mosaic(tiles, tmp_path / "out", options=OPTIONS, workers=0)
    for name, box in QUARTERS.items():
        assert_is_part(tmp_path / "out" / f"{name}.tif", merged[0], box)


def test_memory_does_not_grow_with_the_mosaic(tmp_path):
    ground = np.tile(scene()[:80, :90], (1, 2))
    peaks = []
    for count in (2, 12):
        tiles = tmp_path / f"tiles{count}"
        tiles.mkdir()
        for number in range(count):
            x, width, *rest = WGS84_3ARC
            make_raster(
                tiles / f"t{number}.tif", ground,
                geotransform=(x + number * 180 * width, width, *rest), nodata=-32768,
            )  # fmt: skip
        demsmith.reconstruct_mosaic(tiles, tmp_path / "warm", options=OPTIONS, workers=0,
                                    overwrite=True)  # fmt: skip
        tracemalloc.start()
        demsmith.reconstruct_mosaic(
            tiles, tmp_path / f"out{count}", options=OPTIONS, workers=0, threads=1
        )
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 2 * peaks[0]


def test_a_tile_no_worker_could_hold_is_refused(tmp_path):
    side = int(LARGEST_TILE**0.5) + 1
    path = make_raster(
        tmp_path / "huge.tif", np.zeros((1, 1), np.uint8), geotransform=WGS84_3ARC,
    )  # fmt: skip
    gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    dataset = gdal.GetDriverByName("GTiff").Create(
        path, side, side, 1, gdal.GDT_Byte, ["SPARSE_OK=YES", "TILED=YES"]
    )
    dataset.SetGeoTransform(WGS84_3ARC)
    del dataset
    with pytest.raises(InputError, match=r"huge.tif.*gdal_retile"):
        demsmith.reconstruct_mosaic(path, tmp_path / "out", workers=0)
    assert not (tmp_path / "out").exists()


def test_chunks_follow_the_tiles(tmp_path):
    tiles = raster.open_tiles(raster.tile_paths(cut(tmp_path / "a", scene(), shared=1)))
    assert chunk_side(tiles) == (80, 90)


@pytest.mark.parametrize("trouble", ["truncated", "finer", "utm", "void", "same name", "band"])
def test_bad_tiles_are_named_and_nothing_is_left(tmp_path, trouble):
    tiles = cut(tmp_path / "tiles", scene())
    bad = tiles / "sw.tif"
    how = {}
    if trouble == "truncated":
        bad.write_bytes(bad.read_bytes()[:3000])
    elif trouble == "finer":
        x, width, _, y, _, height = WGS84_3ARC
        make_raster(bad, scene(), geotransform=(x, width / 3, 0, y, 0, height / 3))
    elif trouble == "utm":
        make_raster(bad, scene(), geotransform=(5e5, 90, 0, 5e6, 0, -90), crs="EPSG:32631")
    elif trouble == "void":
        how, bad = dict(below=99999), "every cell is a void"
    elif trouble == "same name":
        bad = tmp_path / "sw.tif"
        (tiles / "sw.tif").rename(bad)
        cut(tiles, scene(), {"sw": QUARTERS["sw"]})
        how, tiles = dict(), [tiles, bad]
    else:
        how = dict(band=2)
        bad = "band 2 asked"
    with pytest.raises(InputError, match=os.path.basename(bad)):
        demsmith.reconstruct_mosaic(tiles, tmp_path / "out", options=OPTIONS, workers=0, **how)
    assert not (tmp_path / "out").exists()


def test_outputs_are_not_replaced_unasked(tmp_path):
    tiles = cut(tmp_path / "tiles", scene())
    out = tmp_path / "out"
    out.mkdir()
    (out / "ne.tif").write_text("precious")
    with pytest.raises(OutputError, match="exists already"):
        demsmith.reconstruct_mosaic(tiles, out, options=OPTIONS, workers=0)
    assert os.listdir(out) == ["ne.tif"]
    demsmith.reconstruct_mosaic(tiles, out, options=OPTIONS, workers=0, overwrite=True)
    assert raster.read(out / "ne.tif").values.shape == (80, 91)
    with pytest.raises(InputError, match="is in the output folder"):
        demsmith.reconstruct_mosaic(tiles, tiles, options=OPTIONS, workers=0)


def test_refused_ways_to_run(tmp_path):
    tiles = cut(tmp_path / "tiles", scene())
    with pytest.raises(InputError, match="not both"):
        demsmith.reconstruct_mosaic(tiles, tmp_path / "o", workers=1, scheduler="tcp://x:1")
    with pytest.raises(InputError, match="workers is -1"):
        demsmith.reconstruct_mosaic(tiles, tmp_path / "o", workers=-1)


def test_dask_cluster(tmp_path, merged):
    distributed = pytest.importorskip("distributed", reason="the extra distributed is missing")
    tiles = cut(tmp_path / "tiles", scene(), shared=1)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        demsmith.reconstruct_mosaic(
            tiles, tmp_path / "out", options=OPTIONS, scheduler=cluster.scheduler_address
        )
    for name, box in QUARTERS.items():
        assert_is_part(tmp_path / "out" / f"{name}.tif", merged[0], box)


def test_in_this_process_cancel_reaches_between_tasks(tmp_path):
    class Stop(Silent):
        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        InThisProcess().run([_task(_refuse, tmp_path / "x")], stop=None, progress=Stop())

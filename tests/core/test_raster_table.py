"""Reading tables of points."""

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.raster import read_samples_file, read_table, write_points

POINTS = [[1.5, 2.5, 3.5], [4.0, -5.0, 6e2]]


def table(tmp_path, text, name="points.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    "text",
    [
        "1.5,2.5,3.5\n4,-5,6e2\n",
        "1.5, 2.5, 3.5\r\n4, -5, 6e2\r\n",
        "1.5;2.5;3.5\n4;-5;600\n",
        "1,5;2,5;3,5\n4;-5;6e2\n",
        "1.5\t2.5\t3.5\n4\t-5\t600",
        "1,5\t2,5\t3,5\n4\t-5\t600",
        "  1.5   2.5 3.5\n4 -5\t600\n\n",
        "1,5 2,5 3,5\n4 -5 600\n",
        "x,y,z\n1.5,2.5,3.5\n4,-5,600\n",
        '"X";"Y";"Z"\n"1,5";"2,5";"3,5"\n4;-5;600\n',
        "# x y z\n# measured in May\n1.5 2.5 3.5 # the first\n\n  # between\n4 -5 600\n",
        "#z,y,x\n3.5,2.5,1.5\n600,-5,4\n",
        "id,Elevation,lat,LON,name\n1,3.5,2.5,1.5,peak\n2,600,-5,4,\n",
        'name,easting,northing,h\n"a, b",1.5,2.5,3.5\nc,4,-5,600\n',
        "x,y,z,height\n1.5,2.5,3.5,9\n4,-5,600,9\n",
        "id,xcoord,ycoord,elev\n1,1.5,2.5,3.5\n2,4,-5,600\n",
        "POINT_X,POINT_Y,h\n1.5,2.5,3.5\n4,-5,600\n",
        "1.5,2.5,3.5,extra\n4,-5,600\n",
    ],
)
def test_ways_to_write_a_table(tmp_path, text):
    features = read_table(table(tmp_path, text))
    np.testing.assert_array_equal(features.points, POINTS)
    assert features.lines == ()
    assert features.crs == ""
    assert features.notes == ()


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1", "cp1252"])
def test_encodings(tmp_path, encoding):
    text = "x;y;z;Höhenbezug\n1,5;2,5;3,5;Müritz\n4;-5;600;Öd\n"
    features = read_table(table(tmp_path, text, encoding=encoding))
    np.testing.assert_array_equal(features.points, POINTS)


def test_columns_asked_for(tmp_path):
    path = table(tmp_path, "id,a,b,c,Höhe\n7,1.5,2.5,9,3.5\n8,4,-5,9,600\n", encoding="latin-1")
    for asked in (dict(x="a", y="B", z="höhe"), dict(x=2, y=3, z=5), dict(x="2", y="b", z="5")):
        np.testing.assert_array_equal(read_table(path, **asked).points, POINTS)
    with pytest.raises(InputError, match="no column 'depth'; its columns are: 'id', 'a', 'b'"):
        read_table(path, x="a", y="b", z="depth")
    with pytest.raises(InputError, match="three different"):
        read_table(path, x="a", y="a", z="c")
    with pytest.raises(InputError, match="line 2"):
        read_table(path, x="a", y="b", z=6)


def test_columns_by_number_without_header(tmp_path):
    path = table(tmp_path, "7 3.5 1.5 2.5\n8 600 4 -5\n", "points.xyz")
    np.testing.assert_array_equal(read_table(path, x=3, y=4, z=2).points, POINTS)
    with pytest.raises(InputError, match="no column 'z'; its columns are: without names"):
        read_table(path, z="z")


def test_unknown_names_mean_the_first_three(tmp_path):
    features = read_table(table(tmp_path, "a,b,c\n1.5,2.5,3.5\n4,-5,600\n"))
    np.testing.assert_array_equal(features.points, POINTS)
    assert "first three of its columns 'a', 'b', 'c'" in features.notes[0]


def test_a_missing_axis_is_asked_for(tmp_path):
    path = table(tmp_path, "x,y,depth\n1.5,2.5,3.5\n")
    with pytest.raises(InputError, match=r"is z\? .* 'x', 'y', 'depth'"):
        read_table(path)
    assert read_table(path, z="depth").points[0, 2] == 3.5


def test_rows_without_elevation_are_left_out(tmp_path):
    path = table(tmp_path, "x,y,z\n1.5,2.5,3.5\n1,1,\n2,2,NaN\n3,3,n/a\n4,-5,600\n")
    features = read_table(path)
    np.testing.assert_array_equal(features.points, POINTS)
    assert "3 of 5 rows" in features.notes[0]


def test_bad_rows_are_named_by_line(tmp_path):
    bad = "# survey\nx,y,z\n1,2,3\n1,two,3\n\n4,5\n1,2,3\n,2,3\n1,2,3 m\n"
    with pytest.raises(InputError, match=r"line 4: 1,two,3; line 6: 4,5; line 8: ,2,3; line 9"):
        read_table(table(tmp_path, bad))
    many = "".join(f"{n},{n},{n}\n" for n in range(60_000))
    with pytest.raises(InputError, match=r"line 60001: oops"):
        read_table(table(tmp_path, many + "oops\n"))
    with pytest.raises(InputError, match=r"line 71: .* line 75: 1,2,x; and 5 more"):
        read_table(table(tmp_path, many[:600] + "1,2,x\n" * 10))


def test_first_row_that_is_bad_is_no_header(tmp_path):
    with pytest.raises(InputError, match="line 1: 1,2,none of it"):
        read_table(table(tmp_path, "1,2,none of it\n1,2,3\n"))


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z\n", "# nothing\n\n", "1,2\n3,4\n", "once upon a time\n", "x,y,z\n1,1,nan\n",
        "{" + "a" * 200_000 + "}\n", "x,y,z\n1,2,3\n" + '"4' * 200_000,
    ],
)  # fmt: skip
def test_no_points(tmp_path, text):
    with pytest.raises(InputError, match=r"points\.csv"):
        read_table(table(tmp_path, text))


def test_bad_files(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_table(tmp_path / "none.csv")
    with pytest.raises(InputError, match="is empty"):
        read_table(table(tmp_path, ""))
    with pytest.raises(InputError, match="no text"):
        read_table(table(tmp_path, "GIF89a\0\0\1"))
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        read_table(tmp_path / "folder.csv")


def test_reprojection(tmp_path):
    pytest.importorskip("osgeo.osr", reason="GDAL is missing")
    path = table(tmp_path, "lat,lon,ele\n0,3,50\n91,3,60\n")
    features = read_table(path, source_crs="EPSG:4326", crs="EPSG:32631")
    np.testing.assert_allclose(features.points, [[500_000, 0, 50]], atol=1e-6)
    assert features.crs == "EPSG:32631"
    assert "1 of 2 rows" in features.notes[0]
    taken = read_table(path, crs="EPSG:32631")
    np.testing.assert_array_equal(taken.points[0], [3, 0, 50])
    assert "no CRS" in taken.notes[0]


class Counting:
    def __init__(self, cancel_after):
        self.cancel_after, self.seen = cancel_after, []

    def report(self, fraction):
        self.seen.append(fraction)

    def cancelled(self):
        return len(self.seen) >= self.cancel_after


def test_progress_and_cancelling(tmp_path):
    path = table(tmp_path, "".join(f"{n},{n},{n}\n" for n in range(170_000)))
    heard = Counting(99)
    assert len(read_table(path, progress=heard).points) == 170_000
    assert heard.seen == sorted(heard.seen)
    assert 0.1 < heard.seen[0] < 0.5 < heard.seen[-1] <= 1
    with pytest.raises(Cancelled):
        read_table(path, progress=Counting(1))


finite = st.floats(-1e15, 1e15, allow_subnormal=False)


@given(
    points=arrays.arrays(np.float64, st.tuples(st.integers(1, 20), st.just(3)), elements=finite),
    mark=st.sampled_from([(",", "."), (";", ","), (";", "."), ("\t", ","), (" ", "."), (" ", ",")]),
    header=st.booleans(),
    ending=st.sampled_from(["\n", "\r\n"]),
)
def test_any_table_comes_back(tmp_path_factory, points, mark, header, ending):
    delimiter, decimal = mark
    rows = [[repr(float(value)).replace(".", decimal) for value in row] for row in points]
    if header:
        rows.insert(0, ["x", "y", "z"])
    text = "".join(delimiter.join(row) + ending for row in rows)
    path = table(tmp_path_factory.mktemp("table"), text)
    np.testing.assert_array_equal(read_samples_file(path).points, points)


@given(
    points=arrays.arrays(np.float64, st.tuples(st.integers(1, 20), st.just(3)), elements=finite),
    dtype=st.sampled_from([np.float32, np.float64]),
)
def test_written_tables_come_back(tmp_path_factory, points, dtype):
    points = points.astype(dtype)
    path = write_points(tmp_path_factory.mktemp("table") / "a.csv", *points.T)
    np.testing.assert_array_equal(read_table(path).points.astype(dtype), points)

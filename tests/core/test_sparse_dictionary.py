"""Dictionaries of all kinds: samples, provenance, mixing, resampling, two resolutions, files."""

import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import fractal
from support import truncate

from demsmith.core.errors import InputError, OutputError
from demsmith.core.noise import NoiseSums
from demsmith.core.sectioned import open_sectioned, write_sectioned
from demsmith.core.sparse import (
    CutAtoms,
    Dictionary,
    FunctionAtoms,
    SampledAtoms,
    read_dictionary,
    write_dictionary,
)
from demsmith.core.sparse.atoms import averaged
from demsmith.core.sparse.dictionary_file import KIND
from demsmith.core.sparse.patches import disc_weights

GROUND = np.rint(fractal((90, 100), seed=4, relief=300)).astype(np.int16)
SUMS = NoiseSums([1, 0, 2], [7, 7, 9], [[1, 0.5], [1, 0], [2, 1]], [[2, 1], [2, 1], [1.5, 0.5]])


def sampled(factor=1, count=5, seed=0):
    rng = np.random.default_rng(seed)
    low = rng.normal(size=(count, 10, 8)).astype(np.float32)
    high = None if factor == 1 else rng.normal(size=(count, 10 * factor, 8 * factor))
    return SampledAtoms(low, None if high is None else high.astype(np.float32))


def cut(factor=1):
    places = np.array([[0, 0, 0], [1, 7, 3], [0, 90 - 10 * factor, 100 - 8 * factor]])
    return CutAtoms((GROUND, (GROUND[:50] * 0.1).astype(np.float32)), ("a", "b"), places)


def mixed(factor=1):
    parts = sampled(factor), cut(factor), FunctionAtoms(SUMS)
    return Dictionary(10, 8, parts, factor, (20.0, 30.0))


def same(one, other, **tolerance):
    np.testing.assert_allclose(one.samples, other.samples, **tolerance)
    assert (one.factor, one.cell_size) == (other.factor, other.cell_size)
    assert [one.provenance(i) for i in range(len(one))] == [
        other.provenance(i) for i in range(len(other))
    ]
    if one.factor > 1:
        np.testing.assert_allclose(one.high(), other.high(), **tolerance)


def test_every_atom_has_mean_0_and_norm_1_over_the_disc():
    dictionary = mixed()
    inside = dictionary.disc.ravel()
    assert len(dictionary) == len(dictionary.samples) == 11
    assert (dictionary.samples[:, ~inside] == 0).all()
    np.testing.assert_allclose(dictionary.samples[:, inside].mean(axis=1), 0, atol=1e-5)
    norms = np.sqrt((dictionary.samples[:, inside] ** 2).mean(axis=1))
    np.testing.assert_allclose(norms, 1, atol=1e-5)


def test_every_atom_tells_where_it_comes_from():
    dictionary = mixed()
    told = [dictionary.provenance(i) for i in range(len(dictionary))]
    assert [each.kind for each in told] == ["sampled"] * 5 + ["patch"] * 3 + ["function"] * 3
    assert (told[6].exemplar, told[6].row, told[6].column) == ("b", 7, 3)
    assert told[10].function == 2
    assert dictionary.provenance(-1) == told[10]
    with pytest.raises(IndexError):
        dictionary.provenance(11)


def test_flat_and_huge_atoms_are_harmless():
    low = np.zeros((2, 10, 8), np.float32)
    low[1] = np.linspace(-1e30, 1e30, 80).reshape(10, 8)
    samples = Dictionary(10, 8, (SampledAtoms(low),)).samples
    assert (samples[0] == 0).all()
    assert np.isfinite(samples).all()
    assert samples[1].any()


def test_both_resolutions_are_divided_by_the_coarser_norm():
    factor = 4
    dictionary = Dictionary(10, 8, (cut(factor),), factor)
    fine = GROUND[:40, :32].astype(float)
    coarse = averaged(fine, factor)
    inside, fine_inside = dictionary.disc, disc_weights(40, 32) > 0
    norm = np.sqrt(((coarse - coarse[inside].mean())[inside] ** 2).mean())
    expected = np.where(fine_inside, (fine - fine[fine_inside].mean()) / norm, 0)
    np.testing.assert_allclose(dictionary.high([0])[0], expected.ravel(), atol=1e-4)
    np.testing.assert_array_equal(dictionary.high([2, 0]), dictionary.high()[[2, 0]])


def test_dictionaries_mix():
    one, other = Dictionary(10, 8, (sampled(),)), Dictionary(10, 8, (cut(), FunctionAtoms(SUMS)))
    joined = Dictionary.joined([one, other])
    np.testing.assert_array_equal(joined.samples, np.vstack([one.samples, other.samples]))
    assert joined.provenance(5) == other.provenance(0)
    with pytest.raises(InputError, match="side_columns 8 and 10"):
        Dictionary.joined([one, one.resampled(10, 10)])
    with pytest.raises(InputError, match="factor"):
        Dictionary.joined([one, Dictionary(10, 8, (sampled(2),), 2)])


@pytest.mark.parametrize("factor", [1, 2])
def test_resampling_keeps_shapes(factor):
    rows, columns = np.mgrid[:10, :8] / 3.0
    wave = np.sin(rows) * np.cos(columns)
    low = wave[None].astype(np.float32)
    high = None
    if factor == 2:
        rows, columns = (np.mgrid[:20, :16] + 0.5) / 2 - 0.5
        high = (np.sin(rows / 3) * np.cos(columns / 3))[None].astype(np.float32)
    dictionary = Dictionary(10, 8, (SampledAtoms(low, high),), factor, (8.0, 10.0))
    finer = dictionary.resampled(20, 16)
    rows, columns = (np.mgrid[:20, :16] + 0.5) / 2 - 0.5
    expected = np.sin(rows / 3) * np.cos(columns / 3)
    expected = Dictionary(20, 16, (SampledAtoms(expected[None].astype(np.float32)),)).samples
    inner = (disc_weights(20, 16) > 0.05).ravel()
    np.testing.assert_allclose(finer.samples[:, inner], expected[:, inner], atol=0.1)
    assert finer.cell_size == (4.0, 5.0)
    back = finer.resampled(10, 8)
    inner = (disc_weights(10, 8) > 0.05).ravel()
    np.testing.assert_allclose(
        back.samples[:, inner], dictionary.samples[:, inner], atol=0.15
    )  # smoothed on the way
    assert dictionary.resampled(10, 8) is dictionary
    if factor == 2:
        assert finer.high().shape == (1, 40 * 32)


def test_functions_are_exact_at_any_resolution():
    dictionary = Dictionary(5, 5, (FunctionAtoms(SUMS),)).resampled(25, 25)
    middle = Dictionary(25, 25, (FunctionAtoms(SUMS),))
    np.testing.assert_array_equal(dictionary.samples, middle.samples)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Dictionary(10, 8, ()), "at least one atom"),
        (lambda: Dictionary(0, 8, (sampled(),)), "side_rows is 0"),
        (lambda: Dictionary(10, 9, (sampled(),)), "low has shape"),
        (lambda: Dictionary(10, 8, (sampled(),), 2), "high has shape None"),
        (lambda: Dictionary(10, 8, (cut(),), 8), "reaches beyond"),
        (lambda: Dictionary(10, 8, (SampledAtoms(np.full((1, 10, 8), np.nan)),)), "not finite"),
        (
            lambda: Dictionary(10, 8, (CutAtoms((GROUND,), ("a",), np.array([[1, 0, 0]])),)),
            "none of the exemplars",
        ),
        (lambda: Dictionary.of_samples(np.ones((3, 81)), 10, 8), "none of blocks"),
        (lambda: Dictionary(10, 8, (sampled(),)).high(), "one resolution"),
    ],
)
def test_refusals(make, message):
    with pytest.raises(InputError, match=message):
        make()


# --- files ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [1, 2])
@pytest.mark.parametrize(
    ("precision", "error"), [("float32", 1e-6), ("float16", 2e-3), ("int8", 0.03)]
)
def test_files_keep_everything(tmp_path, factor, precision, error):
    dictionary = mixed(factor)
    write_dictionary(tmp_path / "x.dsd", dictionary, precision=precision)
    again = read_dictionary(tmp_path / "x.dsd")
    same(again, dictionary, atol=error)
    cut_atoms = slice(5, None)  # exact in any case
    np.testing.assert_array_equal(again.samples[cut_atoms], dictionary.samples[cut_atoms])
    assert again.parts[1].exemplars[0].dtype == np.int16


def test_a_file_is_as_small_as_told(tmp_path):
    dictionary = Dictionary(10, 8, (sampled(count=1000),))
    sizes = []
    for precision in ("float32", "float16", "int8"):
        write_dictionary(tmp_path / "x.dsd", dictionary, precision=precision)
        sizes.append((tmp_path / "x.dsd").stat().st_size)
    assert sizes[0] < 1000 * 320 * 1.01
    assert sizes[1] < 0.55 * sizes[0]
    assert sizes[2] < 0.3 * sizes[0]


@pytest.mark.parametrize("kind", ["uint8", "int16", "uint16", "int32", "float32", "float64"])
def test_exemplars_of_any_type(tmp_path, kind):
    values = (GROUND - GROUND.min()).astype(kind)
    places = np.array([[0, 0, 0], [0, 20, 30]])
    dictionary = Dictionary(10, 8, (CutAtoms((values,), ("é",), places),))
    write_dictionary(tmp_path / "x.dsd", dictionary)
    same(read_dictionary(tmp_path / "x.dsd"), dictionary, atol=1e-6)


def test_what_cannot_be_written(tmp_path):
    with pytest.raises(InputError, match="precision is 'double'"):
        write_dictionary(tmp_path / "x.dsd", mixed(), precision="double")
    with pytest.raises(OutputError):
        write_dictionary(tmp_path / "none" / "x.dsd", mixed())
    assert list(tmp_path.iterdir()) == []


def test_missing_truncated_and_foreign_files(tmp_path):
    path = tmp_path / "x.dsd"
    with pytest.raises(InputError, match="x.dsd"):
        read_dictionary(path)
    write_dictionary(path, mixed())
    truncate(path, 0.7)
    with pytest.raises(InputError, match="truncated"):
        read_dictionary(path)
    path.write_bytes(b"no dictionary at all" * 10)
    with pytest.raises(InputError, match="dictionary"):
        read_dictionary(path)


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """Give a file's header and sections, to be tampered with and sealed again."""
    path = tmp_path_factory.mktemp("dsd") / "x.dsd"
    write_dictionary(path, mixed(2), precision="int8")
    with open_sectioned(path, KIND) as file:
        sections = {
            name: [file.part(name, i) for i in range(count)] for name, count in file.counts.items()
        }
        return file.header, sections


def tampered(header, path, value):
    """Copy a header with one value changed."""
    if not path:
        return value
    first, *others = path
    copy = header.copy()
    copy[first] = tampered(copy[first], others, value)
    return copy


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("side",), [10]), (("side",), [10, 8.0]), (("side",), [0, 8]), (("side",), [512, 512]),
        (("side", 0), True), (("factor",), 10**9), (("factor",), None), (("cell",), [0.0, 1.0]),
        (("cell",), [float("nan"), 1.0]), (("cell",), "x"), (("parts",), []), (("parts",), {}),
        (("parts", 0), 7), (("parts", 0, "kind"), "pickle"), (("parts", 0, "kind"), ["x"]),
        (("parts", 0, "atoms"), 6), (("parts", 0, "atoms"), 1 << 24), (("parts", 0, "atoms"), -1),
        (("parts", 0, "type"), "object"), (("parts", 0, "type"), ["int8"]),
        (("parts", 0, "placed"), 1), (("parts", 0, "placed"), True), (("parts", 0, "names"), 3),
        (("parts", 1, "exemplars"), []), (("parts", 1, "exemplars", 0), [90, 100, "O"]),
        (("parts", 1, "exemplars", 0), [90, 100, []]),
        (("parts", 1, "exemplars", 0), [65536, 65536, "int16"]),
        (("parts", 1, "exemplars", 0), [91, 100, "int16"]),
        (("parts", 1, "exemplars", 0), [100, 90, "int16"]),
        (("parts", 1, "names"), ["a"]), (("parts", 2, "terms"), 9), (("parts", 2, "terms"), 1),
    ],
)  # fmt: skip
def test_hostile_headers_are_refused(tmp_path, unpacked, path, value):
    header, sections = unpacked
    file = tmp_path / "x.dsd"
    write_sectioned(file, KIND, header=tampered(header, path, value), sections=sections)
    with pytest.raises(InputError, match="x.dsd"):
        read_dictionary(file)


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_hostile_sections_are_refused_or_harmless(tmp_path_factory, unpacked, data):
    header, sections = unpacked
    name = data.draw(st.sampled_from(sorted(sections)))
    plain = bytearray(zlib.decompress(sections[name][0]))
    for _ in range(data.draw(st.integers(1, 8))):
        plain[data.draw(st.integers(0, len(plain) - 1))] = data.draw(st.integers(0, 255))
    plain = plain[: data.draw(st.sampled_from([len(plain), len(plain) - 1]))]
    file = tmp_path_factory.mktemp("h") / "x.dsd"
    changed = sections | {name: [zlib.compress(bytes(plain)), *sections[name][1:]]}
    write_sectioned(file, KIND, header=header, sections=changed)
    try:
        dictionary = read_dictionary(file)
    except InputError:
        return
    assert np.isfinite(dictionary.samples).all()


def test_a_bomb_is_not_unpacked(tmp_path, unpacked):
    header, sections = unpacked
    bomb = zlib.compress(bytes(50 << 20), 9)
    write_sectioned(tmp_path / "x.dsd", KIND, header=header, sections=sections | {"0.low": [bomb]})
    with pytest.raises(InputError, match="0.low"):
        read_dictionary(tmp_path / "x.dsd")

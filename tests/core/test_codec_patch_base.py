"""The coded patch tree: what comes back, in every window, and what damaged bytes may do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal

from demsmith.core.codec.patch_base import MOST_SAMPLES, PatchBase, encode
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.sparse import PatchGrid, PatchTree, decompose, gather, refine


def cosines(side_rows=10, side_columns=10, count=20):
    """Atoms of a DCT dictionary over the disc."""
    grid = PatchGrid((20, 20), side_rows, side_columns, side_rows // 2, side_columns // 2)
    y, x = np.mgrid[:side_rows, :side_columns] + 0.5
    atoms = []
    for k in sorted(np.ndindex(6, 6), key=sum)[1 : count + 1]:
        atom = np.cos(np.pi * k[0] * y / side_rows) * np.cos(np.pi * k[1] * x / side_columns)
        atom = np.where(grid.disc, atom - atom[grid.disc].mean(), 0)
        atoms.append(atom / np.sqrt((atom[grid.disc] ** 2).mean()))
    return np.float32(atoms).reshape(count, -1)


def coded(shape=(90, 70), *, sparsity=2, step=2.0, void=None, seed=3, grid=None, **options):
    ground = fractal(shape, seed=seed).astype(np.float32)
    void = np.zeros(shape, bool) if void is None else void
    grid = PatchGrid(shape) if grid is None else grid
    atoms = cosines(grid.side_rows, grid.side_columns)
    tree = decompose(ground, void, dictionary=atoms, sparsity=sparsity, grid=grid)
    params, sections = encode(ground, void, tree=tree, step=step, **options)
    return ground, tree, params, sections


def decoder(params, sections, **options):
    return PatchBase(params, lambda section, index: sections[section][index], **options)


def rmse(a, b):
    return float(np.sqrt(((a.astype(float) - b) ** 2).mean()))


def size(sections):
    return sum(len(part) for parts in sections.values() for part in parts)


# --- what comes back ------------------------------------------------------------------------------


@settings(max_examples=15, deadline=None)
@given(
    shape=st.tuples(st.integers(8, 90), st.integers(8, 90)),
    sides=st.sampled_from([(10, 10, 5, 5), (6, 11, 2, 5), (5, 5, 1, 2)]),
    sparsity=st.sampled_from([1, 3, 20]),
    step=st.sampled_from([0.05, 3.0, 500.0]),
    holed=st.booleans(),
)
def test_steps_come_back_and_differ_from_the_tree_by_no_more_than_rounding(
    shape, sides, sparsity, step, holed
):
    void = np.zeros(shape, bool)
    if holed:
        void = disc(shape, (shape[0] // 3, shape[1] // 3), 12)
        void[-1, -1] = False
    grid = PatchGrid(shape, *sides)
    _, tree, params, sections = coded(
        shape, sparsity=sparsity, step=step, void=void, grid=grid, sweeps=0, atom_step=1 / 256
    )
    back = decoder(params, sections).tree()
    known = (tree.coefficients != 0).any(axis=1)  # discs of voids alone may have any mean
    assert abs(back.means - tree.means)[known].max(initial=0) <= 0.5 * step + 2e-4
    order = (back.atoms @ tree.atoms.T).argmax(axis=1)  # which of the tree's atoms each one is
    given_, found = np.zeros((2, grid.count, len(tree.atoms)))
    for k in range(sparsity):
        given_[np.arange(grid.count), tree.indices[:, k]] += tree.coefficients[:, k]
        found[np.arange(grid.count), order[back.indices[:, k]]] += back.coefficients[:, k]
    assert abs(found - given_).max() <= 0.6 * params["coefficient_step"] + 1e-3
    if not holed:
        by_atoms = sparsity * abs(tree.coefficients).max() / 256
        assert rmse(back.evaluate(), tree.evaluate()) < step * (1 + sparsity) + by_atoms


def test_a_window_has_the_same_bits_as_the_whole():
    _, _, params, sections = coded((700, 411), sparsity=2)
    assert len(sections["discs"]) == 6
    whole = decoder(params, sections, threads=1).window(0, 700, 0, 411)
    assert whole.dtype == np.float32
    for window in ((0, 1, 0, 1), (310, 330, 315, 325), (5, 699, 400, 411), (319, 320, 0, 411)):
        part = decoder(params, sections, threads=3).window(*window)
        row, end_row, column, end_column = window
        assert part.tobytes() == whole[row:end_row, column:end_column].tobytes()
    tree = decoder(params, sections).tree()
    assert tree.evaluate().tobytes() == whole.tobytes()
    for scale in (0.25, 1.5):
        part = decoder(params, sections).window(20, 60, 7, 99, scale=scale, coefficients=1)
        expected = tree.evaluate((20, 60, 7, 99), scale=scale, coefficients=1)
        assert part.tobytes() == expected.tobytes()


def test_only_tiles_over_the_window_are_asked_for():
    _, _, params, sections = coded((700, 411))
    asked = []

    def part(section, index):
        asked.append((section, index))
        return sections[section][index]

    base = PatchBase(params, part)
    base.window(10, 60, 10, 60)
    assert asked == [("dictionary", 0), ("discs", 0)]
    base.window(20, 90, 10, 60)
    assert len(asked) == 2, "a tile just decoded was decoded again"


def test_threads_do_not_matter():
    one, many = (coded((700, 411), threads=threads)[2:] for threads in (1, 4))
    assert one == many


def test_smaller_steps_are_closer_and_larger():
    found = []
    for step in (0.5, 4.0, 32.0):
        ground, tree, params, sections = coded((200, 200), sparsity=6, step=step)
        error = rmse(decoder(params, sections).window(0, 200, 0, 200), ground)
        found.append((error, -size(sections)))
    assert found == sorted(found)
    refined = refine(ground, tree=tree, sweeps=4)
    assert found[0][0] < 1.05 * rmse(refined.evaluate(), ground) + 0.2


def test_refinement_is_worth_it():
    errors = []
    for sweeps in (0, 4):
        ground, _, params, sections = coded((200, 200), sparsity=3, sweeps=sweeps)
        errors.append(rmse(decoder(params, sections).window(0, 200, 0, 200), ground))
    assert errors[1] < 0.8 * errors[0]


def test_neighbours_tell_much():
    """A smooth surface takes far fewer bits than its numbers' entropy."""
    _, _, params, sections = coded((500, 500), sparsity=2, step=1.0)
    back = decoder(params, sections).tree()
    bits = 0.0
    for numbers in (back.means, back.indices, back.coefficients):
        _, counts = np.unique(numbers, return_counts=True)
        bits += numbers.size * -(counts / numbers.size * np.log2(counts / numbers.size)).sum()
    assert 8 * sum(map(len, sections["discs"])) < 0.75 * bits


def test_discs_of_voids_cost_next_to_nothing():
    shape = (400, 400)
    void = np.ones(shape, bool)
    void[:40, :40] = False
    holed = size(coded(shape, void=void)[3]) - len(coded(shape, void=void)[3]["dictionary"][0])
    small = coded((40, 40))[3]["discs"][0]
    assert holed < 1.5 * len(small) + 60


def test_a_large_dictionary_comes_in_parts():
    """The terrain's own discs as atoms, one each."""
    ground = fractal((300, 290), seed=9).astype(np.float32)
    void = np.zeros(ground.shape, bool)
    grid = PatchGrid(ground.shape)
    atoms = gather(ground, void, grid).samples
    tree = decompose(ground, void, dictionary=atoms, sparsity=1, grid=grid)
    params, sections = encode(ground, void, tree=tree, step=0.1, atom_step=0.1, sweeps=0)
    assert len(sections["dictionary"]) == 2
    assert rmse(decoder(params, sections).window(0, 300, 0, 290), ground) < 0.3


def test_unused_atoms_are_left_out():
    shape = (40, 40)
    ground = fractal(shape).astype(np.float32)
    atoms = cosines()
    grid = PatchGrid(shape)
    indices = np.full((grid.count, 1), 7)
    tree = PatchTree(grid, np.zeros(grid.count), indices, np.ones((grid.count, 1)), atoms)
    params, sections = encode(ground, ground < 0, tree=tree, step=0.1, sweeps=0)
    assert params["atoms"] == 1
    np.testing.assert_allclose(decoder(params, sections).tree().atoms[0], atoms[7], atol=0.1)
    flat = PatchTree(grid, np.zeros(grid.count), indices, np.zeros((grid.count, 1)), atoms)
    params, sections = encode(ground, ground < 0, tree=flat, step=0.1, sweeps=0)
    assert (decoder(params, sections).window(0, 40, 0, 40) == 0).all()
    assert size(sections) < 250


# --- what is refused ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["step", "coefficient_step", "atom_step"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, 1e-9])
def test_impossible_steps_are_refused(name, value):
    with pytest.raises(InputError, match=name):
        coded((30, 30), **(dict(step=2.0) | {name: value}))


VALID = coded((60, 60))[2:]


NO_NUMBERS = [None, "7", b"5", [5], True, 10**400, np.nan, np.inf, 1e300]
NO_SIZES = [-1, 0, 2**40]


@pytest.mark.parametrize("name", VALID[0])
def test_params_are_not_trusted(name):
    params, sections = VALID
    with pytest.raises(InputError, match="patch tree"):
        decoder({k: v for k, v in params.items() if k != name}, sections)
    sizes = [] if name == "offset" else [*NO_SIZES, 0.0, -3.0]
    for value in NO_NUMBERS + sizes:
        with pytest.raises(InputError, match=rf"patch tree: {name} is"):
            decoder(params | {name: value}, sections)


def test_sizes_that_only_together_are_too_large_are_refused():
    params, sections = VALID
    huge = dict(side_rows=512, side_columns=512, step_rows=256, step_columns=256)
    for change, words in (
        (huge | dict(atoms=MOST_SAMPLES // 512**2 + 1), "more than"),
        (dict(tile=256, sparsity=3), "too large"),
        (dict(atom_step=1e19), "too large to be any"),
        (dict(step=1e20, coefficient_step=1e-29), "differ too much"),
        (dict(step=1e-29, coefficient_step=1e20), "differ too much"),
    ):
        with pytest.raises(InputError, match=words):
            decoder(params | change, sections)


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_damaged_bytes_decode_to_something_of_the_right_shape(data):
    params, sections = VALID
    name = data.draw(st.sampled_from(["dictionary", "discs"]))
    part = bytearray(sections[name][0])
    for _ in range(data.draw(st.integers(1, 4))):
        part[data.draw(st.integers(0, len(part) - 1))] = data.draw(st.integers(0, 255))
    part = part[: data.draw(st.integers(0, len(part)))]
    part += data.draw(st.binary(max_size=9))
    base = decoder(params, sections | {name: [bytes(part)]})
    window = base.window(0, 60, 0, 60)
    assert window.shape == (60, 60) and np.isfinite(window).all()


def test_windows_outside_are_refused():
    with pytest.raises(InputError, match="not in the raster"):
        decoder(*VALID).window(0, 61, 0, 60)


def test_cancel_is_heard():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        decoder(*VALID).window(0, 60, 0, 60, progress=Stop())
    with pytest.raises(Cancelled):
        coded((30, 30), progress=Stop())


def test_params_are_plain():
    """They go into the file's header as they are."""
    for value in VALID[0].values():
        assert type(value) in (int, float)

"""The wavelet and its tree: exact windows, overviews, decay of the error with the step."""

import numpy as np
import pytest

from demsmith.core.codec._wavelet import forward, inverse
from demsmith.core.codec.pyramid import LEVELS, Analysis, Pyramid
from demsmith.core.codec.tiling import Tiling

SHAPES = [(1, 1), (1, 50), (50, 1), (5, 3), (256, 257), (300, 520)]


def _terrain(shape, seed=0):
    rows, columns = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    waves = 90 * np.sin(rows / 31) * np.cos(columns / 47) + 20 * np.sin((rows + columns) / 7)
    return (waves + np.random.default_rng(seed).normal(size=shape)).astype(np.float32)


def _decoder(tree, tiling, sections):
    return Pyramid(tiling, float(tree.step), LEVELS, lambda name, index: sections[name][index])


@pytest.mark.parametrize("shape", [*SHAPES, (2, 2), (3, 7)])
def test_bands_join_to_what_was_split(shape):
    z = _terrain(shape)
    assert np.allclose(inverse(*forward(z.copy())), z, atol=1e-3)


def test_bands_of_noise_have_unit_gain():
    noise = np.random.default_rng(0).normal(size=(256, 256)).astype(np.float32)
    for band in forward(noise):
        assert 0.9 < np.sqrt(np.mean(band**2)) < 1.1


def test_a_constant_is_its_own_mean_and_has_no_details():
    low, *details = forward(np.full((33, 20), 7, np.float32))
    assert np.allclose(low, 14, atol=1e-4)
    assert all(np.abs(band).max() < 1e-4 for band in details)


@pytest.mark.parametrize("shape", SHAPES)
def test_tree_comes_back_and_any_window_is_cut_from_the_same_surface(shape):
    tiling = Tiling(shape, 64)
    tree = Analysis(_terrain(shape), tiling).tree(3.0)
    sections = tree.sections()
    whole = _decoder(tree, tiling, sections).window((0, shape[0]), (0, shape[1]))
    assert np.array_equal(whole, tree.surface())
    rng = np.random.default_rng(1)
    for _ in range(8):
        rows, columns = (sorted(rng.choice(side + 1, 2, replace=False)) for side in shape)
        part = _decoder(tree, tiling, sections).window(tuple(rows), tuple(columns))
        assert np.array_equal(part, whole[slice(*rows), slice(*columns)])


def test_error_follows_the_step():
    z = _terrain((200, 200))
    analysis = Analysis(z, Tiling(z.shape, 64))
    for step in (0.5, 2.0, 8.0):
        error = np.sqrt(np.mean((analysis.tree(step).surface() - z) ** 2))
        assert error < step * 0.45  # uniform rounding: 0.29, and small coefficients that are cut


def test_overviews_are_means_and_decode_only_the_beginning_of_parts():
    z = _terrain((256, 320))
    tiling = Tiling(z.shape, 64)
    tree = Analysis(z, tiling).tree(0.5)
    sections = tree.sections()
    for level in (1, 2, 3):
        side = 1 << level
        means = z.reshape(256 // side, side, 320 // side, side).mean(axis=(1, 3))
        spans = tuple((0, count) for count in means.shape)
        overview = _decoder(tree, tiling, sections).overview(*spans, level)
        # About the means, and nowhere else: half a square aside they would differ far more.
        assert np.sqrt(np.mean((overview - means) ** 2)) < 0.15 * means.std()
        aside = np.sqrt(np.mean((overview[:, 1:] - means[:, :-1]) ** 2))
        assert np.sqrt(np.mean((overview[:, 1:] - means[:, 1:]) ** 2)) < 0.5 * aside
        part = _decoder(tree, tiling, sections).overview((3, 9), (5, 30), level)
        assert np.array_equal(part, overview[3:9, 5:30])
    cut = {"root": sections["root"], "tree": [part[: len(part) // 3] for part in sections["tree"]]}
    spans = (0, 32), (0, 40)
    coarse = [_decoder(tree, tiling, kept).overview(*spans, 3) for kept in (cut, sections)]
    assert np.array_equal(*coarse)


def test_same_bytes_for_any_number_of_threads():
    z = _terrain((200, 300))
    tree = Analysis(z, Tiling(z.shape, 64)).tree(2.0)
    assert tree.sections(threads=1) == tree.sections(threads=3)


def test_bands_of_zeros_take_next_to_nothing():
    z = np.zeros((512, 512), np.float32)
    sections = Analysis(z, Tiling(z.shape, 256)).tree(1.0).sections()
    assert sum(len(part) for part in sections["tree"]) < 40

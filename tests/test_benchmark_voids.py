"""The slow peers' kept results belong to the masks that the benchmark punches today."""

from pathlib import Path

import numpy as np
import pytest
from support import shared_data

SMALL = "pair_bigbutte (SRTM)"


@pytest.fixture
def peers(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[1] / "benchmarks"))
    shared_data("pair_bigbutte/big_butte_small_SRTM_utm12.tif")
    import voids_peers

    return voids_peers


@pytest.mark.parametrize("kind", ["mixture", "transplanted", "single"])
def test_results_are_kept_of_todays_masks(peers, kind):
    from voids_masks import SEEDS, mask, tile

    for seed in SEEDS:
        kept = peers.kept_tallies(tile(SMALL), mask(SMALL, kind, seed))
        assert {"scikit-image biharmonic", "SAGA spline"} <= set(kept)


def test_kept_results_score_as_fresh_ones(peers):
    from voids_masks import mask, tile

    from demsmith.core.validation.scoring import Holes

    ground, void = tile(SMALL), mask(SMALL, "mixture", 0)
    holes = Holes(ground.values, void, pixel_size=ground.pixel_size)
    fresh = holes.tally(peers.biharmonic(ground, void)).errors()
    kept = peers.kept_tallies(ground, void)["scikit-image biharmonic"].errors()
    for ours, theirs in zip(fresh, kept, strict=True):
        measured = [(e.voids, e.cells, e.rmse, e.bias, e.slope_rmse) for e in (ours, theirs)]
        np.testing.assert_allclose(*measured, rtol=1e-3, atol=1e-4)

"""The accurate engine on real ground: better than the peers, and honest about it."""

from pathlib import Path

import numpy as np
import pytest
from support import shared_data

from demsmith.core.validation.scoring import Holes, Tally
from demsmith.core.voids import fill_voids

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

TILE = "pair_bigbutte (SRTM)"  # the smallest that every peer has done


@pytest.fixture(scope="module")
def masks():
    """The benchmark's: its ground, and its masks with the peers' tallies that it keeps."""
    shared_data("pair_bigbutte/big_butte_small_SRTM_utm12.tif")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(Path(__file__).resolve().parents[2] / "benchmarks"))
        from voids_masks import SEEDS, mask, tile
        from voids_peers import kept_tallies

        ground = tile(TILE)
        voids = [mask(TILE, kind, seed) for kind in ("mixture", "transplanted") for seed in SEEDS]
        return ground, voids, [kept_tallies(ground, void) for void in voids]


@pytest.fixture(scope="module")
def errors(masks):
    """Errors by class, all masks pooled, of both methods and the slow peers."""
    ground, voids, kept = masks
    tallies = {"auto": Tally.zero(), "mcmd": Tally.zero()}
    for void in voids:
        holes = Holes(ground.values, void, pixel_size=ground.pixel_size)
        holed = np.where(void, -9999, ground.values)
        for method in tallies:
            filled = fill_voids(holed, void, method=method, pixel_size=ground.pixel_size)
            tallies[method] += holes.tally(filled.values, filled.sigma)
    for peer in set.intersection(*map(set, kept)):
        tallies[peer] = sum((each[peer] for each in kept), start=Tally.zero())
    return {method: tally.errors() for method, tally in tallies.items()}


def classes_with_enough(errors):
    return [k for k, each in enumerate(errors["auto"]) if each.voids >= 20]


def test_peers_and_classes_are_there(errors):
    assert "scikit-image biharmonic" in errors
    assert len(classes_with_enough(errors)) >= 3


def test_better_than_every_peer_and_than_mcmd_in_every_class(errors):
    ours = errors["auto"]
    for method in errors.keys() - {"auto"}:
        for k in classes_with_enough(errors):
            assert ours[k].rmse < errors[method][k].rmse, (method, ours[k].name)


def test_slopes_are_better_than_the_biharmonics(errors):
    ours, theirs = errors["auto"], errors["scikit-image biharmonic"]
    for k in classes_with_enough(errors):
        assert ours[k].slope_rmse < theirs[k].slope_rmse, ours[k].name


def test_intervals_hold_what_they_should(errors):
    for k in classes_with_enough(errors):
        each = errors["auto"][k]
        assert 0.55 < each.within_68 < 0.8, each.name
        assert 0.88 < each.within_95 < 0.99, each.name

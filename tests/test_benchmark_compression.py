"""The peers' kept results belong to the rasters that compression is judged on today."""

from pathlib import Path

import numpy as np
import pytest
from support import shared_data

SMALL = "multi_stormlake (orig)"  # 15 thousand cells, with voids


@pytest.fixture
def peers(monkeypatch):
    pytest.importorskip("imagecodecs", reason="peers of the benchmark need imagecodecs")
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[1] / "benchmarks"))
    shared_data("multi_stormlake/storml_elev_orig.tif")
    import compression_peers

    return compression_peers


@pytest.fixture
def small(peers):
    from compression_tiles import ground

    return ground(SMALL)


def test_results_are_kept_of_todays_rasters(peers, small):
    kept = peers.results(small)
    assert {name: set(by_setting) for name, by_setting in kept.items()} == {
        name: set(peer.settings(small)) for name, peer in peers.PEERS.items()
    }


@pytest.mark.parametrize(
    ("peer", "setting"),
    [("LERC + zstd", 5), ("JPEG XL", 0), ("JPEG XL", 5), ("GeoTIFF", "ZSTD"), ("JPEG 2000", 1)],
)
def test_kept_results_are_as_fresh_ones(peers, small, peer, setting):
    fresh = peers.measure(small, peers.PEERS[peer], setting)
    kept = peers.results(small)[peer][setting]
    assert kept.size == pytest.approx(fresh.size, rel=0.02)  # versions of coders may differ
    assert kept.rmse == pytest.approx(fresh.rmse, rel=0.02)
    assert fresh.voids in {peers.OWN, peers.MASK, peers.VALUE}


def test_a_coder_that_breaks_its_promise_is_found(peers, small):
    def off_by_two(ground, _):
        return peers.Code(1, ground.values + 2, peers.OWN)

    broken = peers.Peer(off_by_two, lambda _: (1,), lambda error: error)
    with pytest.raises(RuntimeError, match=r"off by 2\.0 m"):
        peers.measure(small, broken, 1)
    assert peers.measure(small, broken, 2).rmse == 2


def test_voids_cost_their_mask(peers, small):
    empty = np.zeros_like(small.void)
    with_mask = peers._filled(small.values, small.void, peers._jpeg2000)
    without = peers._filled(peers._nearest(small.values, small.void), empty, peers._jpeg2000)
    assert with_mask.size - without.size == peers._mask_size(small.void) > 0

"""Progress of filling, and cancel."""

import contextlib
import threading
import time

import numpy as np
import pytest
from scenes import disc, fractal

from demsmith.core.errors import Cancelled
from demsmith.core.voids import fill_voids

VARIANTS = ("relaxed", "weighted", "paper")


class Recorder:
    """Notes every report; asks to stop once ``stop_at`` is reached."""

    def __init__(self, stop_at=None):
        self.fractions, self.stop_at, self.thread = [], stop_at, threading.get_ident()
        self.asked = None

    def report(self, fraction):
        assert threading.get_ident() == self.thread  # a GUI may not be touched from another
        self.fractions.append(fraction)

    def cancelled(self):
        reached = self.stop_at is not None and max(self.fractions, default=0) >= self.stop_at
        if reached and self.asked is None:
            self.asked = time.perf_counter()
        return reached


CASES = {
    "many small": lambda shape: np.random.default_rng(0).random(shape) < 0.3,
    "one large": lambda shape: disc(shape, (400, 400), 350),
    "both": lambda shape: (
        disc(shape, (400, 400), 300) | (np.random.default_rng(0).random(shape) < 0.1)
    ),
}


@pytest.mark.parametrize("r_s", [0.0, 0.2])
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_progress_rises_from_0_to_1(variant, case, threads, r_s):
    truth = fractal((800, 800)).astype(np.float32)
    void = CASES[case](truth.shape)
    show = Recorder()
    fill_voids(truth, void, method="mcmd", variant=variant, threads=threads, progress=show, r_s=r_s)
    assert_progress_rises(show)


def assert_progress_rises(show):
    assert len(show.fractions) >= 5
    assert (np.diff(show.fractions) >= 0).all()
    assert 0 <= show.fractions[0] < 0.6
    assert 0.8 < show.fractions[-1] <= 1


SMALLER_CASES = {  # than MCMD's, for learning and estimating take longer
    "many small": lambda: np.random.default_rng(0).random((400, 400)) < 0.1,
    "one large": lambda: disc((400, 400), (200, 200), 45),
    "all but few": lambda: np.random.default_rng(0).random((150, 150)) < 0.95,
}


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("case", SMALLER_CASES)
def test_progress_of_the_accurate_engine(case, threads):
    void = SMALLER_CASES[case]()
    show = Recorder()
    fill_voids(fractal(void.shape).astype(np.float32), void, threads=threads, progress=show)
    assert_progress_rises(show)


@pytest.mark.parametrize("after", [0.0, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("case", SMALLER_CASES)
def test_cancel_of_the_accurate_engine_is_prompt(case, after):
    """At any time, also while a single large void is worked on."""
    void = SMALLER_CASES[case]()
    truth = fractal(void.shape).astype(np.float32)
    fill_voids(truth, void & disc(void.shape, (75, 75), 30))  # compiles
    before, begin = truth.copy(), time.perf_counter()

    class Impatient:
        def report(self, fraction):
            pass

        def cancelled(self):
            return time.perf_counter() - begin > after

    with contextlib.suppress(Cancelled):  # or it was done before
        fill_voids(truth, void, threads=2, progress=Impatient())
    assert time.perf_counter() - begin < after + 1
    np.testing.assert_array_equal(truth, before)


@pytest.mark.parametrize("stop_at", [0.0, 0.4])
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_cancel_is_prompt(variant, case, threads, stop_at):
    truth = fractal((800, 800)).astype(np.float32)
    void = CASES[case](truth.shape)
    options = dict(method="mcmd", variant=variant)
    fill_voids(truth[:50, :50], void[:50, :50] | (truth[:50, :50] < 0), **options)
    show, before = Recorder(stop_at), truth.copy()
    with pytest.raises(Cancelled):
        fill_voids(truth, void, threads=threads, progress=show, **options)
    assert time.perf_counter() - show.asked < 0.5
    assert max(show.fractions, default=0) < 0.95
    np.testing.assert_array_equal(truth, before)

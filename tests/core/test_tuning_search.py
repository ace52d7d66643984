"""The search: finds, keeps to its bounds and its budget, always goes the same way, stops."""

import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith.core.errors import Cancelled, DependencyError, InputError
from demsmith.core.mcmd import McmdOptions
from demsmith.core.samples.options import SampleOptions
from demsmith.core.tuning.parameters import axes_of
from demsmith.core.tuning.score import Comparison, classify
from demsmith.core.tuning.search import Axis, search

PLANE = (Axis("x", 0.0, -10.0, 10.0), Axis("y", 100.0, 1.0, 10000.0, log=True))


def bowl(at, progress):
    return (at["x"] - 3) ** 2 / 10 + math.log(at["y"] / 500) ** 2


def test_finds_the_lowest_point():
    found = search(bowl, PLANE, evaluations=60)
    assert found["x"] == pytest.approx(3, abs=0.3)
    assert found["y"] == pytest.approx(500, rel=0.1)


def test_a_bound_may_be_the_best():
    found = search(lambda at, progress: -at["x"], PLANE[:1])
    assert found == {"x": pytest.approx(10)}


@settings(max_examples=25, deadline=None)
@given(st.floats(-20, 20), st.integers(1, 12))
def test_budget_bounds_and_the_best_of_all(best, evaluations):
    tried = []

    def score(at, progress):
        tried.append((abs(at["x"] - best), at))
        return tried[-1][0]

    found = search(score, PLANE, evaluations=evaluations)
    assert len(tried) <= evaluations
    assert tried[0][1] == {"x": pytest.approx(0), "y": pytest.approx(100)}
    assert found == min(tried, key=lambda each: each[0])[1]
    for _, at in tried:
        assert -10 - 1e-9 <= at["x"] <= 10 + 1e-9
        assert 1 - 1e-9 <= at["y"] <= 10000 * (1 + 1e-9)


def test_always_the_same_way():
    paths = []
    for _ in range(2):
        path = []
        search(lambda at, progress, path=path: path.append(at) or bowl(at, progress), PLANE)
        paths.append(path)
    assert paths[0] == paths[1]


def test_scores_that_are_not_finite_are_the_worst():
    def score(at, progress):
        return math.nan if at["x"] < 1 else at["x"]

    assert search(score, (Axis("x", 5.0, 0.0, 10.0),), evaluations=20)["x"] >= 1


def test_errors_of_the_score_come_out():
    def score(at, progress):
        raise InputError("as it is")

    with pytest.raises(InputError, match="as it is"):
        search(score, PLANE)


def test_cancel_comes_between_evaluations():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return len(tried) >= 3

    tried = []
    with pytest.raises(Cancelled):
        search(lambda at, progress: tried.append(at) or bowl(at, progress), PLANE, progress=Stop())
    assert len(tried) == 3


def test_nlopt_is_named_where_it_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "nlopt", None)
    with pytest.raises(DependencyError, match="nlopt"):
        search(bowl, PLANE)


@given(st.floats(0.1, 9.9), st.booleans())
def test_places_and_values_are_inverse(value, log):
    axis = Axis("x", 1.0, 0.1, 10.0, log=log)
    assert axis.value(axis.place(value)) == pytest.approx(value)


def test_lengths_are_in_metres_and_by_ratio():
    tension, stiffness = axes_of(SampleOptions(variant="converged"), 30.0)
    assert (tension.name, stiffness.name) == ("tension", "stiffness")
    assert tension.log and tension.low == 30


def test_what_was_chosen_lies_between_the_bounds():
    (axis,) = axes_of(McmdOptions(tension=5.0), 90.0)
    assert axis.low == axis.start == 5
    first, second = axes_of(McmdOptions(variant="paper", l=-7.0, l_bu=30.0), 90.0)
    assert (first.low, second.high) == (-7, 30)
    assert axes_of(McmdOptions(variant="paper"), 90.0, fixed={"l"})[0].name == "l_bu"


def test_each_class_counts_alike():
    """A class of few cells halved weighs as much as one of many doubled."""
    sizes = np.repeat([2, 500], [10, 10])
    holes = classify(sizes, sizes, ((1, 16), (17, None)))
    assert holes.classes == ((1, 16), (17, None))
    squares = sizes * 4.0
    np.testing.assert_allclose(holes.rmse(squares), 2)
    changed = squares * np.repeat([0.25, 4.0], 10)
    assert holes.score(changed) == pytest.approx(holes.score(squares))
    assert Comparison(holes, squares, changed).gain().share == pytest.approx(0)
    assert Comparison(holes, squares, squares / 4).gain().share == pytest.approx(0.5)
    assert Comparison(holes, squares, squares / 4).gain().noise == pytest.approx(0, abs=1e-12)


def test_noise_is_the_spread_of_repeated_trials():
    """The bootstrap's standard error, against that over fresh draws of as many holes."""
    rng = np.random.default_rng(0)
    sizes = np.full(100, 5)
    holes = classify(sizes, sizes, ((1, None),))
    gains = [
        Comparison(holes, rng.chisquare(3, 100), rng.chisquare(3, 100)).gain() for _ in range(60)
    ]
    spread = np.std([gain.share for gain in gains])
    assert np.mean([gain.noise for gain in gains]) == pytest.approx(spread, rel=0.3)

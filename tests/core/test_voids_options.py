"""Options of filling: what is refused, and what each has an effect on."""

import numpy as np
import pytest
from scenes import disc, fractal

from demsmith.core.errors import InputError
from demsmith.core.mcmd import Maps
from demsmith.core.options import specifications
from demsmith.core.voids import FILLED, FillOptions, fill_voids, find_voids


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fill_voids(np.full((3, 3), np.nan)), "every cell is a void"),
        (lambda: fill_voids(np.zeros((3, 3)), np.ones((3, 3), bool)), "every cell is a void"),
        (lambda: fill_voids(np.zeros(3)), r"shape \(3,\)"),
        (lambda: fill_voids(np.zeros((2, 3, 4))), "2-D"),
        (lambda: fill_voids(np.zeros((0, 4))), "2-D"),
        (lambda: fill_voids(np.zeros((2, 3), complex)), "complex128"),
        (lambda: fill_voids(np.zeros((2, 3), bool)), "bool"),
        (lambda: fill_voids(np.array([["1", "2"]])), "integers or real numbers"),
        (lambda: fill_voids(np.zeros((2, 3)), np.zeros((3, 2), bool)), r"\(3, 2\).*\(2, 3\)"),
        (lambda: fill_voids(np.zeros((2, 3)), out=np.zeros((3, 2))), r"out is float64 \(3, 2\)"),
        (lambda: fill_voids(np.zeros((2, 3)), out=np.zeros((2, 3), "f4")), "must be float64"),
        (lambda: fill_voids(np.array([[0, np.nan, 0]] * 2), pixel_size=0), "positive and finite"),
        (lambda: fill_voids(np.array([[0, np.nan, 0]] * 2), pixel_size=(1, 2, 3)), "3 parts"),
        (
            lambda: fill_voids(np.array([[0, np.nan, 0]] * 2), pixel_size=(1, np.nan)),
            "positive and finite",
        ),
        (
            lambda: fill_voids(np.array([[0, np.nan, 0]] * 2), pixel_size=(np.ones(3), 1)),
            r"\(3,\) for 2 rows",
        ),
        (lambda: fill_voids(np.zeros((2, 3)), colour="red"), "colour"),
        (lambda: fill_voids(np.zeros((2, 3)), options=FillOptions(), seed=3), "not both"),
        (lambda: fill_voids(np.zeros((2, 3)), l=1.0), "'relaxed' has no such curve"),
        (lambda: fill_voids(np.zeros((2, 3)), l_bu=1.0), "'relaxed' has no such curve"),
        (lambda: fill_voids(np.zeros((2, 3)), variant="best"), "relaxed, weighted, paper"),
        (lambda: fill_voids(np.zeros((2, 3)), threads=0), "at least 1"),
        (lambda: fill_voids(np.zeros((2, 3)), variant="paper", datum=1), "datum 1 m is above"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(InputError, match=message):
        call()


def test_options_may_be_given_at_once_or_one_by_one():
    truth, void = fractal((40, 50)), disc((40, 50), (20, 20), 9)
    once = fill_voids(truth, void, options=FillOptions(variant="paper", l_bu=2.0, l=1.0)).values
    each = fill_voids(truth, void, variant="paper", l_bu=2.0, l=1.0).values
    np.testing.assert_array_equal(once, each)
    assert (once != fill_voids(truth, void, variant="paper").values).any()


@pytest.mark.parametrize("name", ["l", "l_bu", "datum"])
def test_curve_options_have_an_effect(name):
    truth, void = fractal((40, 50)) + 100, disc((40, 50), (20, 20), 9)
    base = dict(variant="weighted", l=1.0, l_bu=1.0, datum=50.0)
    plain = fill_voids(truth, void, **base).values
    other = fill_voids(truth, void, **(base | {name: base[name] - 0.5})).values
    assert (other[void] != plain[void]).any()


def test_d_max_has_an_effect():
    truth, void = fractal((40, 50)), disc((40, 50), (20, 20), 9)
    near, far = (
        fill_voids(truth, void, variant="paper", l=1.0, d_max=d).values for d in (30.0, 3000.0)
    )
    assert near[void].mean() < far[void].mean() - 1


OTHERWISE = dict(
    variant="weighted", scheme="triangle-edge", l=1.0, l_bu=1.0, datum=10.0, h=0.3, r_s=0.1,
    r_t=0.2, relief=50.0,
)  # fmt: skip


def test_every_option_of_mcmd_is_met_here_but_those_of_both_engines():
    own = {spec.name for spec in specifications(FillOptions) if spec.advanced}
    assert own == {*OTHERWISE, "tension", "seed"}


@pytest.mark.parametrize("name", OTHERWISE)
def test_auto_hands_over_to_mcmd_where_mcmds_own_options_are_set(name):
    needs = dict(variant="weighted") if name in ("l", "l_bu", "datum") else {}
    options = {**needs, name: OTHERWISE[name]}
    truth, void = fractal((40, 50)) + 100, disc((40, 50), (20, 20), 9)
    auto, mcmd = (fill_voids(truth, void, method=m, **options) for m in ("auto", "mcmd"))
    np.testing.assert_array_equal(auto.values, mcmd.values)
    assert auto.sigma is None and auto.choices is None and auto.model is None
    assert (auto.source()[void] == FILLED).all()


def test_auto_hands_over_to_mcmd_where_maps_are_given():
    truth, void = fractal((40, 50)), disc((40, 50), (20, 20), 9)
    maps = Maps(r_s=np.full(truth.shape, 0.1))
    auto, mcmd = (fill_voids(truth, void, method=m, maps=maps) for m in ("auto", "mcmd"))
    np.testing.assert_array_equal(auto.values, mcmd.values)
    assert auto.sigma is None


def test_tension_and_seed_are_options_of_both_engines():
    truth, void = fractal((40, 50)), disc((40, 50), (20, 20), 9)
    plain, seeded, taut = (
        fill_voids(truth, void, **options) for options in ({}, dict(seed=3), dict(tension=2.0))
    )
    assert taut.sigma is not None
    np.testing.assert_array_equal(seeded.values, plain.values)
    assert (taut.values != plain.values)[void].any()


def test_voids_of_a_fill_are_found_voids():
    truth, void = fractal((40, 50)), disc((40, 50), (20, 20), 9)
    np.testing.assert_array_equal(fill_voids(truth, void).voids.labels, find_voids(void).labels)

"""Validation: which methods are right on which ground, and what is told of it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal, holed, plane

from demsmith.core.errors import Cancelled, DependencyError, InputError
from demsmith.core.validation import METHODS, VoidShape, validate, void_shapes
from demsmith.core.validation import methods as methods_module
from demsmith.core.validation import validation as validation_module

DEMSMITH = "mcmd"
ALL = ("mcmd", "gdal", "gdal-smooth", "biharmonic")


class Recorder:
    """A progress that remembers, and stops at ``stop``."""

    def __init__(self, stop=2.0):
        self.stop, self.seen = stop, [0.0]

    def report(self, fraction):
        self.seen.append(fraction)

    def cancelled(self):
        return self.seen[-1] >= self.stop


def overall(found):
    return {score.method: score.errors[-1] for score in found.scores}


def small_voids(shape=(200, 200)):
    return holed(shape, (50, 54, 50, 58), (100, 103, 90, 92), (150, 151, 30, 33))


def test_a_plane_comes_back_by_methods_that_reproduce_planes():
    ground = plane((200, 200), slope=(3.0, -2.0))
    error = overall(validate(ground, small_voids(), methods=ALL))
    assert error["biharmonic"].rmse < 1e-6
    assert error["biharmonic"].slope_rmse < 1e-6
    assert error[DEMSMITH].max_error < 0.5 < 2 < error["gdal"].max_error
    for each in error.values():
        assert each.cells == error["gdal"].cells > 1000


def test_a_constant_error_is_a_bias(monkeypatch):
    ground = fractal((200, 200))

    def raised(trial, progress):
        return methods_module.Estimate(ground + 7, np.full(ground.shape, 10.0), 0.25)

    monkeypatch.setitem(METHODS, "raised", methods_module.Method("raised", "Raised", raised))
    found = validate(ground, small_voids(), methods=["raised"])
    error = overall(found)["raised"]
    assert (error.bias, error.rmse, error.mae) == pytest.approx((7, 7, 7), abs=1e-3)
    assert (error.within_68, error.within_95) == (1, 1)
    assert error.slope_rmse < 1e-3  # all is raised alike, the rim too
    assert found.scores[0].seconds == 0.25
    assert found.scores[0].states_intervals
    np.testing.assert_allclose(found.error[~np.isnan(found.error)], 7, atol=1e-3)


def test_methods_see_nothing_of_what_is_hidden(monkeypatch):
    """They are given no elevation there, and neither of real voids."""
    seen = []

    def look(trial, progress):
        seen.append(trial)
        return methods_module.Estimate(np.zeros_like(trial.values), None, 0.0)

    monkeypatch.setitem(METHODS, "look", methods_module.Method("look", "Look", look))
    void = small_voids()
    validate(fractal((200, 200)), void, methods=["look"], seeds=2)
    assert len(seen) == 2
    for trial in seen:
        assert not (trial.hidden & void).any()
        np.testing.assert_array_equal(trial.void, void | trial.hidden)
        np.testing.assert_array_equal(np.isnan(trial.values), trial.void)
    assert (seen[0].hidden != seen[1].hidden).any()


@pytest.mark.parametrize("method", METHODS)
def test_hidden_elevations_do_not_reach_a_method(method):
    """Other elevations in the hidden cells change nothing of the fill."""
    ground = fractal((120, 120)).astype(np.float32)
    hidden = small_voids((200, 200))[:120, :120]
    one, other = (
        METHODS[method].fill(
            methods_module.Trial(np.where(hidden, rubbish, ground), hidden, hidden), Recorder()
        ).values
        for rubbish in (-9999, 8000)
    )  # fmt: skip
    np.testing.assert_array_equal(one, other)


def test_the_shapes_are_the_own_ones_those_given_or_a_mixture():
    ground = fractal((200, 200), relief=3000)
    own = validate(ground, small_voids(), methods=["gdal"], seeds=1)
    assert own.shapes_from == "own" and own.notes == ()
    hidden = ~np.isnan(own.error)
    assert {shape.size for shape in void_shapes(hidden)} == {32, 6, 3}
    other = validate(
        ground, small_voids(), shapes=[VoidShape(np.ones((3, 3), bool))], methods=["gdal"], seeds=1
    )
    assert other.shapes_from == "other"
    assert {shape.size for shape in void_shapes(~np.isnan(other.error))} == {9}
    mixture = validate(ground, methods=["gdal"], seeds=1)
    assert mixture.shapes_from == "mixture" and "mixture" in mixture.notes[0]
    at_edge = validate(ground, holed((200, 200), (0, 9, 0, 9)), methods=["gdal"], seeds=1)
    assert at_edge.shapes_from == "mixture"


def test_masks_are_pooled_and_the_same_seeds_find_the_same():
    ground, void = fractal((200, 200)), small_voids()
    single = [validate(ground, void, methods=["gdal"], seeds=1, seed=seed) for seed in (5, 6)]
    both = validate(ground, void, methods=["gdal"], seeds=2, seed=5)
    again = validate(ground, void, methods=["gdal"], seeds=2, seed=5, threads=1)
    errors = [overall(found)["gdal"] for found in (*single, both)]
    assert errors[2].cells == errors[0].cells + errors[1].cells
    squares = sum(each.rmse**2 * each.cells for each in errors[:2])
    assert errors[2].rmse == pytest.approx(np.sqrt(squares / errors[2].cells))
    assert overall(again)["gdal"].as_dict() == errors[2].as_dict()
    np.testing.assert_array_equal(both.error, again.error)


def test_real_voids_stay_out_of_all():
    ground, void = fractal((200, 200)), small_voids()
    one, other = (
        validate(np.where(void, rubbish, ground), void, methods=ALL, seeds=1)
        for rubbish in (-32768.0, np.nan)
    )
    for method in ALL:
        assert overall(one)[method].as_dict() == overall(other)[method].as_dict()
    assert np.isnan(one.error[void]).all()


def test_the_best_is_the_one_of_least_rmse_that_filled_all(monkeypatch):
    ground = fractal((200, 200))

    def lazy(trial, progress):
        values = ground.copy()
        values[:150] = np.nan
        return methods_module.Estimate(values, None, 0.0)

    monkeypatch.setitem(METHODS, "lazy", methods_module.Method("lazy", "Lazy", lazy))
    found = validate(ground, small_voids(), methods=["gdal", "lazy", DEMSMITH])
    assert overall(found)["lazy"].rmse == 0
    assert found.best.method == DEMSMITH
    assert any("Lazy left out" in note for note in found.notes)


def test_too_large_voids_are_left_out_by_biharmonic_and_that_is_said(monkeypatch):
    monkeypatch.setattr(methods_module, "LARGEST_BIHARMONIC", 20)
    monkeypatch.setattr(validation_module, "LARGEST_BIHARMONIC", 20)
    found = validate(
        fractal((200, 200)), small_voids(), methods=["gdal", "biharmonic"], share=0.005
    )
    sizes = {score.method: [each.cells for each in score.errors] for score in found.scores}
    assert sizes["biharmonic"][0] == sizes["gdal"][0] > 0
    assert sizes["biharmonic"][1] == 0 < sizes["gdal"][1]
    assert any("more than 20 cells" in note for note in found.notes)


def test_biharmonic_in_parts_is_scikit_image_s_at_once(monkeypatch):
    from skimage.restoration import inpaint_biharmonic

    monkeypatch.setattr(methods_module, "_BATCH_CELLS", 100)
    ground = fractal((150, 150))
    void = disc((150, 150), (40, 40), 12) | disc((150, 150), (100, 90), 20)
    void |= holed((150, 150), (5, 9, 100, 120), (70, 71, 10, 60), (56, 58, 30, 40), (0, 2, 20, 30))
    trial = methods_module.Trial(ground, void, void)
    mine = METHODS["biharmonic"].fill(trial, Recorder()).values
    theirs = inpaint_biharmonic(np.where(void, 0, ground), void, split_into_regions=True)
    np.testing.assert_allclose(mine, theirs, atol=1e-6)


@settings(max_examples=10, deadline=None)
@given(
    dtype=st.sampled_from(["uint8", "int16", "uint16", "int32", "float32", "float64", ">i2"]),
    rows=st.integers(40, 90), columns=st.integers(40, 90),
)  # fmt: skip
def test_every_type_and_shape(dtype, rows, columns):
    ground = (fractal((90, 90))[:rows, :columns] / 5).astype(dtype)
    found = validate(ground, methods=["mcmd", "gdal"], seeds=1)
    error = overall(found)["mcmd"]
    assert error.cells > 0 and error.max_error <= 200
    real = overall(validate(ground.astype(np.float64), methods=["mcmd"], seeds=1))["mcmd"]
    assert (error.cells, error.rmse) == (real.cells, pytest.approx(real.rmse, rel=1e-3))


# --- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "void", "said"),
    [
        (np.zeros((9, 9)), np.ones((9, 9), bool), "every cell is a void"),
        (np.full((9, 9), np.nan), None, "every cell is a void"),
        (np.zeros((1, 1)), None, "no artificial void fits"),
        (np.zeros((3, 3)), holed((3, 3), (1, 2, 1, 2)), "no artificial void fits"),
        (np.zeros(9), None, "give a 2-D array"),
        (np.zeros((9, 9), complex), None, "real numbers"),
    ],
)
def test_ground_that_nothing_can_be_tried_on(values, void, said):
    with pytest.raises(InputError, match=said):
        validate(values, void, methods=["mcmd"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"methods": ["kriging"]}, "no method 'kriging'; choose from auto, mcmd"),
        ({"methods": []}, "no method is given"),
        ({"methods": ["gdal", "gdal"]}, "named twice"),
        ({"share": 0.9}, "share is 0.9"),
        ({"seeds": 0}, "seeds is 0"),
        ({"shapes": ()}, "no void whose shape"),
        ({"rounds": 3}, "rounds"),
    ],
)
def test_wrong_options(options, said):
    with pytest.raises(InputError, match=said):
        validate(fractal((60, 60)), **options)


def test_a_method_without_its_library(monkeypatch):
    absent = methods_module.Method("odd", "Odd", None, "no_such_module", "Odd Library")
    monkeypatch.setitem(METHODS, "odd", absent)
    with pytest.raises(DependencyError, match="odd needs Odd Library"):
        validate(fractal((60, 60)), methods=["odd"])
    found = validate(fractal((60, 60)), seeds=1)
    assert "odd" not in overall(found)
    assert any("odd is left out: Odd Library is not installed" in note for note in found.notes)


def test_progress_rises_to_the_end():
    progress = Recorder()
    validate(fractal((200, 200)), small_voids(), methods=ALL, progress=progress)
    assert progress.seen == sorted(progress.seen)
    assert progress.seen[-1] == pytest.approx(1)
    assert len(progress.seen) > 20


@pytest.mark.parametrize("stop", [0.0, 0.05, 0.3, 0.6, 0.92])
def test_cancel(stop):
    with pytest.raises(Cancelled):
        validate(fractal((200, 200)), small_voids(), methods=ALL, progress=Recorder(stop))

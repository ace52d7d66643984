"""Tuning: what it finds on ground made to have an answer, and that it takes no guess for one."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scenes import fractal, holed

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.mcmd.maps import Maps
from demsmith.core.samples.options import SampleOptions
from demsmith.core.tuning import tune_fill, tune_samples, tuning
from demsmith.core.validation import errors_by_size, punch_voids
from demsmith.core.voids import FillOptions, fill_voids

CELL = 90.0
SHAPE = (320, 360)
NO_VOID = np.zeros(SHAPE, bool)
TAUT = FillOptions(method="mcmd", tension=CELL)
CURVED = FillOptions(variant="weighted", l=2.0, l_bu=10.0)


def smooth():
    """Ground so smooth that tension can only harm."""
    return fractal(SHAPE, exponent=2.5, relief=2000).astype(np.float32)


def white_noise():
    """Ground without any slope to continue: the tautest surface is the best."""
    return np.random.default_rng(5).normal(0, 50, SHAPE).astype(np.float32)


def rmse(ground, void, options):
    filled = fill_voids(ground, void, options=options, pixel_size=CELL).values
    return errors_by_size(filled, ground, void)[-1].rmse


def tune(ground, options, void=NO_VOID, **more):
    return tune_fill(ground, void, options=options, pixel_size=CELL, **more)


@pytest.fixture(scope="module")
def tuned():
    """Smooth ground, tuned from a surface that is far too taut."""
    return tune(smooth(), TAUT)


def test_the_known_best_is_found(tuned):
    assert tuned.accepted and tuned.note == ""
    before, after = tuned.parameters["tension"]
    assert before == CELL and after > 20 * CELL
    assert tuned.gain > 0.2 and tuned.gain > 3 * tuned.noise > 0


def test_the_opposite_is_found_on_the_opposite_ground():
    tuned = tune(white_noise(), FillOptions(method="mcmd", tension=100 * CELL))
    assert tuned.accepted and tuned.parameters["tension"][1] < 2 * CELL
    assert tuned.gain > 2 * tuned.noise > 0


def test_both_curves_of_the_passes_are_tuned():
    tuned = tune(smooth(), CURVED)
    assert tuned.accepted and tuned.gain > 0.5
    assert set(tuned.parameters) == {"l", "l_bu"}
    assert tuned.options.l_bu < 5


def test_the_gain_holds_on_a_mask_never_seen(tuned):
    void = punch_voids(smooth(), seed=77)
    gain = 1 - rmse(smooth(), void, tuned.options) / rmse(smooth(), void, TAUT)
    assert gain > tuned.gain / 2


def test_errors_are_told_by_size(tuned):
    assert tuned.errors[0].smallest == 1 and tuned.errors[-1].largest is None
    for lower, upper in zip(tuned.errors[:-1], tuned.errors[1:], strict=True):
        assert upper.smallest == lower.largest + 1
    assert all(each.after < each.before and each.holes >= 8 for each in tuned.errors)


def test_nothing_but_the_tuned_parameters_changes():
    options = replace(TAUT, r_s=0.3, seed=4, interior_only=True, max_size=50)
    tuned = tune(smooth(), options)
    assert tuned.accepted
    assert replace(tuned.options, tension=CELL) == options


def test_noise_and_selection_have_no_say(tuned):
    """The same surface is sought whatever roughness is laid on it, and whichever voids are left."""
    rough = tune(
        smooth(),
        replace(TAUT, r_s=0.3, natural_roughness=True, interior_only=True, max_size=50),
    )
    assert (rough.parameters, rough.gain) == (tuned.parameters, tuned.gain)


def test_the_same_again_and_by_any_number_of_threads(tuned):
    assert tune(smooth(), TAUT, threads=1) == tuned


def test_what_lies_in_voids_has_no_say():
    void = holed(SHAPE, (40, 90, 50, 120))
    ground = smooth()
    assert tune(np.where(void, -32768, ground), TAUT, void) == tune(ground, TAUT, void)


def test_a_worse_find_is_refused(monkeypatch):
    """Were the search to come back with nonsense, the options stay."""
    monkeypatch.setattr(tuning, "search", lambda *_, **__: {"tension": CELL})
    options = FillOptions(method="mcmd", tension=100 * CELL)
    tuned = tune(smooth(), options)
    assert not tuned.accepted and tuned.options is options
    assert tuned.parameters == {"tension": (100 * CELL, 100 * CELL)}
    assert (tuned.gain, tuned.noise, tuned.errors) == (0, 0, ())
    assert "only -" in tuned.note and tuned.note in tuned.summary()


def test_a_find_for_the_fitted_holes_alone_is_refused(monkeypatch):
    """The first holdout is won, the second lost: that is chance, or a fit too close."""
    compare = tuning._Raster.compare
    calls = []

    def second_is_lost(*arguments):
        one = compare(*arguments)
        calls.append(one)
        return replace(one, before=one.after, after=one.before) if len(calls) == 2 else one

    monkeypatch.setattr(tuning._Raster, "compare", second_is_lost)
    tuned = tune(smooth(), TAUT)
    assert not tuned.accepted and "elsewhere" in tuned.note
    assert len(calls) == 2


def test_holdouts_share_no_cell(monkeypatch):
    seen = []
    punched = tuning.punched_holdouts
    monkeypatch.setattr(
        tuning, "punched_holdouts", lambda *a, **k: seen.extend(punched(*a, **k)) or seen
    )
    void = holed(SHAPE, (40, 90, 50, 120))
    tune(smooth(), TAUT, void)
    times = np.zeros(SHAPE, int)
    for holdout in seen:
        hidden = np.any([trial.hidden for trial in holdout.trials], axis=0)
        assert hidden.any() and not (hidden & void).any()
        for trial in holdout.trials:
            np.testing.assert_array_equal(trial.known, ~void & ~trial.hidden)
        times += hidden
    assert len(seen) == 3 and times.max() == 1


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (8, 160), (6, 4), (40, 40)])
def test_too_little_ground_leaves_the_options(shape):
    tuned = tune(fractal((200, 200))[: shape[0], : shape[1]], TAUT, np.zeros(shape, bool))
    assert not tuned.accepted and tuned.options == TAUT
    assert "too little known ground" in tuned.note


def test_nothing_known_leaves_the_options():
    assert not tune(np.zeros(SHAPE), TAUT, ~NO_VOID).accepted


@pytest.mark.parametrize("dtype", ["int16", "uint8", "float32", "float64"])
def test_every_type_of_elevations(dtype):
    ground = (smooth() / 10).astype(dtype)
    tuned = tune(ground, TAUT)
    assert tuned.accepted and tuned.options.tension > 5 * CELL


def test_maps_are_used_and_left_alone():
    tuned = tune(smooth(), CURVED, maps=Maps(l_bu=np.zeros(SHAPE)))
    assert set(tuned.parameters) == {"l"}
    both = Maps(l=np.zeros(SHAPE), l_bu=np.zeros(SHAPE))
    assert "given by maps" in tune(smooth(), CURVED, maps=both).note


def test_samples_held_back_are_tuned_on():
    ground, known = smooth(), np.random.default_rng(1).random(SHAPE) < 0.05
    options = SampleOptions(variant="weighted", l=2.0, l_bu=10.0)
    tuned = tune_samples(ground, known, options=options, pixel_size=CELL)
    assert tuned.accepted and tuned.options.l_bu < 5
    assert tuned.gain > 3 * tuned.noise > 0
    rubbish = np.where(known, ground, -9999)
    assert tune_samples(rubbish, known, options=options, pixel_size=CELL) == tuned
    few = known & (np.random.default_rng(2).random(SHAPE) < 0.005)
    untuned = tune_samples(ground, few, options=options, pixel_size=CELL)
    assert not untuned.accepted and "too little" in untuned.note


def test_lines_are_held_back_whole():
    """Else the parameters would fit gaps of one cell in lines, not the ground between them."""
    known = np.zeros((200, 200), bool)
    known[::8] = True
    (holdout, *_) = tuning.sampled_holdouts(known, count=3, most_cells=known.size)
    (trial,) = holdout.trials
    assert trial.hidden.any()
    hidden = trial.hidden[::8].reshape(-1, 200)
    for edge in range(0, 200, 64):
        piece = hidden[:, edge : edge + 64]
        assert (piece.all(axis=1) | ~piece.any(axis=1)).all()


def test_large_rasters_are_tuned_on_windows_around_their_voids(monkeypatch):
    monkeypatch.setattr("demsmith.core.tuning.holdouts._FILL_WINDOW", 160)
    monkeypatch.setattr(tuning, "_FILL_CELLS", 160 * 160)
    seen = []
    monkeypatch.setattr(
        "demsmith.core.tuning.holdouts.punch_voids",
        lambda values, *, known, seed, progress: seen.append(known) or punch_voids(
            values, known=known, seed=seed
        ),
    )  # fmt: skip
    tune(smooth(), TAUT, holed(SHAPE, (200, 230, 130, 170)))
    assert {known.shape for known in seen} == {(160, 120)}
    assert all(not known.all() for known in seen)


@pytest.mark.parametrize("after", [0, 3, 40])
def test_cancel(after):
    class Stop:
        asked = 0

        def report(self, fraction):
            pass

        def cancelled(self):
            self.asked += 1
            return self.asked > after

    with pytest.raises(Cancelled):
        tune(smooth(), TAUT, progress=Stop())


def test_progress_only_rises_to_the_end():
    class Track(list):
        def report(self, fraction):
            self.append(fraction)

        def cancelled(self):
            return False

    track = Track()
    tune(smooth(), TAUT, progress=track)
    assert track == sorted(track) and track[-1] == pytest.approx(1) and len(track) > 20


def test_bad_options_are_refused():
    with pytest.raises(InputError, match="tension"):
        tune(smooth(), FillOptions(tension=-1.0))
    with pytest.raises(InputError, match="evaluations is 0"):
        tune(smooth(), TAUT, evaluations=0)


def test_the_result_goes_into_json(tuned):
    content = json.loads(json.dumps(tuned.as_dict(), allow_nan=False))
    assert content["parameters"]["tension"] == {"before": CELL, "after": tuned.options.tension}
    assert content["errors"][0]["before"] > content["errors"][0]["after"]
    assert tuned.summary().startswith("tuned tension ") and "%" in tuned.summary()

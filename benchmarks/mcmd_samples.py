"""Terrain rebuilt from some of its cells: at random, ever fewer, and by detectors."""

import statistics

import numpy as np
import tiles
from mcmd_peers import Scattered, gdal_inverse, gdal_linear, linear, radial, timed
from results import table

import demsmith
from demsmith.core import raster
from demsmith.core.samples.options import SampleOptions
from demsmith.core.samples.presets import with_preset
from demsmith.core.samples.reconstruction import reconstruct
from demsmith.core.thinning.options import DETECTORS
from demsmith.core.tuning import tune_samples

SIDE, CELLS = 1025, 35_721
SEEDS = (0, 1, 2)
OURS = {
    "paper, l = l_bu = 0": SampleOptions(variant="paper"),
    "paper, preset `smooth`": with_preset(SampleOptions(preset="smooth")),
    "weighted": SampleOptions(variant="weighted"),
    "relaxed": SampleOptions(variant="relaxed"),
    "converged (default)": SampleOptions(),
}
SHARES_KEPT = (0.99, 0.9, 0.75, 0.5, 0.25, 0.1, 0.05, 0.02, 0.01)
CURVE_VARIANTS = ("converged", "relaxed", "weighted", "paper")
THINNED = ("pyrenees_raw", "rainier_raw", "sierra_nevada")
THINNED_SHARES = (0.1, 0.05, 0.02)
THINNED_VARIANTS = ("converged", "paper")


def washington(quick):
    """Rebuild Mount Washington from the paper's number of random cells."""
    side = 257 if quick else SIDE
    seeds = SEEDS[:1] if quick else SEEDS
    cells = CELLS * side**2 // SIDE**2
    grounds = [mount_washington(side, cells, seed) for seed in seeds]
    tuned, tuning_seconds = timed(lambda: _tune(grounds[0]))
    methods = {
        "SciPy `RBFInterpolator`, thin plate, 64 neighbours": (radial, grounds[:1]),
        "SciPy `LinearNDInterpolator`": (linear, grounds),
        "GDAL Grid `linear`": (gdal_linear, grounds),
        "GDAL Grid `invdistnn`, 12 points": (gdal_inverse, grounds),
    }
    ours = OURS | ({"converged, tuned": tuned.options} if tuned.accepted else {})
    for label, options in ours.items():
        methods[f"Demsmith {label}"] = (rebuilding(options), grounds)
    _warm_up(methods)
    measured = {label: _measure(*each) for label, each in methods.items()}
    return "\n\n".join(
        [
            f"### Mount Washington: {cells:,} random cells of {side}²",
            "Of `white_mountains` (3″ cells), rows and columns up to the 1025th. RMSE of the "
            f"removed cells. ÷ RBF: on the same samples, seed 0. Seconds: median of {len(seeds)} "
            "(RBF: once).",
            _washington_table(measured),
            "The paper, on another Mount Washington of 1025² cells: RMSE 5.8 m in 2.97 s, "
            "RBF 5.04 m in 531 s; that is 1.15 × the RMSE, 179 × as fast. "
            f"Tuning on the samples of seed 0 ({tuning_seconds:.0f} s): {tuned.summary()}.",
        ]
    )


def mount_washington(side, cells, seed):
    """Give the window around the summit, of which so many cells are known."""
    truth, sizes = tiles.void_free("white_mountains")
    last = np.s_[SIDE - side : SIDE]  # the summit is in the south-east
    return Scattered.at_random(truth[last, last], tuple(size[last] for size in sizes), cells, seed)


def rebuilding(options):
    """Give our reconstruction as a method like those of the peers."""

    def method(ground):
        values, seconds = timed(
            lambda: reconstruct(
                ground.truth, ground.known, options=options, pixel_size=ground.sizes, threads=2
            )
        )
        return values[ground.scored], seconds

    return method


def _tune(ground):
    return tune_samples(
        ground.truth, ground.known, options=SampleOptions(), pixel_size=ground.sizes, threads=2
    )


def _warm_up(methods):
    small = mount_washington(65, 400, 0)
    for method, _ in methods.values():
        method(small)


def _measure(method, grounds):
    """Give the RMSE on each ground, and the median of the seconds."""
    errors, seconds = [], []
    for ground in grounds:
        found, took = method(ground)
        errors.append(ground.rmse(found))
        seconds.append(took)
    return errors, statistics.median(seconds)


def _washington_table(measured):
    (reference,), slowest = next(iter(measured.values()))
    rows = []
    for label, (errors, seconds) in measured.items():
        mean = f"{np.mean(errors):.2f}" if len(errors) > 1 else ""
        first = f"{errors[0]:.2f}", f"**{errors[0] / reference:.3f}**"
        rows.append([label, *first, mean, f"{seconds:.2f}", f"{slowest / seconds:.0f} ×"])
    head = ["method", "RMSE [m], seed 0", "÷ RBF", "mean of seeds 0–2", "seconds", "RBF ÷ it"]
    return table(head, rows)


# --- the curve -----------------------------------------------------------------------------------


def curve(quick):
    """Rebuild from ever fewer random cells, as the paper's figure 10."""
    errors = curve_errors(SHARES_KEPT[5:7] if quick else SHARES_KEPT)
    shares = list(next(iter(errors.values())))
    rows = [
        [label, *(f"{by_share[share]:.2f}" for share in shares)]
        for label, by_share in errors.items()
    ]
    return (
        "### From 99 % to 1 % of the cells\n\n"
        f"RMSE [m] of the removed cells, the same {SIDE}² window, seed 0; the picture is "
        "`docs/images/curve.png`.\n\n"
        + table(["cells kept", *(f"{100 * share:g} %" for share in shares)], rows)
    )


def curve_errors(shares=SHARES_KEPT):
    """Measure the RMSE [m] by method and share of the cells kept.

    Returns
    -------
    dict of dict
        Method to share to RMSE.
    """
    methods = {name: rebuilding(SampleOptions(variant=name)) for name in CURVE_VARIANTS}
    methods["linear (SciPy)"] = linear
    errors = {label: {} for label in methods}
    for share in shares:
        ground = mount_washington(SIDE, round(share * SIDE**2), seed=0)
        for label, method in methods.items():
            errors[label][share] = ground.rmse(method(ground)[0])
    return errors


# --- thinned rasters -----------------------------------------------------------------------------


def thinned(quick):
    """Delete more than 90 % of a tile's cells, but those that a detector keeps."""
    rows = []
    for name in THINNED[:1] if quick else THINNED:
        tile = raster.read(tiles.DATA / (tiles.RAW | tiles.VOID_FREE)[name])
        for share in THINNED_SHARES[:1] if quick else THINNED_SHARES:
            errors = [f"{error:.1f}" for error in _thinned_errors(tile, share)]
            rows.append([name, f"{100 * share:g} %", *errors])
    head = [f"{detector}, {variant}" for variant in THINNED_VARIANTS for detector in DETECTORS]
    return (
        "### More than 90 % of the cells removed\n\n"
        "RMSE [m] of the removed cells by what chose the kept ones (`demsmith thin --detector`) "
        "and by the variant that rebuilt. Raw tiles' own voids are filled on the way; they do "
        "not count.\n\n" + table(["tile", "kept", *head], rows)
    )


def _thinned_errors(tile, share):
    """Give the RMSE by variant and detector."""
    values, sizes = tile.values.astype(np.float32), tuple(tile.grid.pixel_size_m())
    grounds = []
    for detector in DETECTORS:
        kept = demsmith.thin(
            values, tile.void, share=share, detector=detector, pixel_size=sizes
        ).kept
        grounds.append(Scattered(values, kept, ~kept & ~tile.void, sizes))
    for variant in THINNED_VARIANTS:
        method = rebuilding(SampleOptions(variant=variant))
        for ground in grounds:
            yield ground.rmse(method(ground)[0])

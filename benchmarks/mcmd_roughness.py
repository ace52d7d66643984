"""What filled ground looks like: as rough as the ground around, and without preferred axes."""

from dataclasses import dataclass

import numpy as np
import tiles
from results import table
from scipy.ndimage import binary_dilation, find_objects

import demsmith
from demsmith.core.validation import punch_voids
from demsmith.core.voids import find_voids

SEEDS = (0, 1, 2)
LAGS = (1, 2, 4, 8)
MARGIN = 12  # cells around a void that count as its surroundings
LARGE = 100  # cells of the largest void that is left out
ROUGH = "natural roughness"
ACCURATE = {"fill (default, `auto`)": {"method": "auto"}}
SURFACES = {**ACCURATE, "mcmd": {}, ROUGH: {"natural_roughness": True}}
AXIS_SURFACES = {
    **ACCURATE,
    "mcmd": {},
    "weighted": {"variant": "weighted"},
    "weighted, diamond–square": {"variant": "weighted", "scheme": "diamond-square"},
    "paper": {"variant": "paper"},
    "paper, diamond–square": {"variant": "paper", "scheme": "diamond-square"},
    ROUGH: {"natural_roughness": True},
}


@dataclass(frozen=True, eq=False)
class Punched:
    """A tile with artificial voids.

    Attributes
    ----------
    truth : (H, W) float32 array
    void : (H, W) bool array
    large : (H, W) int array
        1 + its number in each large void, 0 elsewhere.
    sizes : (H,) and (H,) arrays
        Ground metres per cell.
    """

    truth: np.ndarray
    void: np.ndarray
    large: np.ndarray
    sizes: tuple

    @classmethod
    def of(cls, name, seed):
        """Punch voids into a void-free tile."""
        truth, sizes = tiles.void_free(name)
        void = punch_voids(truth, seed=seed)
        voids = find_voids(void)
        chosen = np.flatnonzero(voids.cells > LARGE)
        number = np.zeros(len(voids) + 1, np.int64)
        number[chosen + 1] = np.arange(chosen.size) + 1
        return cls(truth, void, number[voids.labels], sizes)

    def surfaces(self, ways):
        """Give the filled surfaces by label, and the truth, as float64."""
        made = {
            label: demsmith.fill_voids(
                self.truth,
                self.void,
                pixel_size=self.sizes,
                threads=2,
                **{"method": "mcmd", **options},
            ).values
            for label, options in ways.items()
        }
        return {
            label: z.astype(np.float64) for label, z in {**made, "true ground": self.truth}.items()
        }

    @property
    def surroundings(self):
        """Known cells near large voids."""
        return binary_dilation(self.large > 0, iterations=MARGIN) & ~self.void


# --- roughness -----------------------------------------------------------------------------------


def roughness(quick):
    """Compare the structure function inside voids with that around, and the steps at their rims."""
    ratios, steps = [], []
    for name in _tiles(quick):
        cases = [Punched.of(name, seed) for seed in SEEDS[: 1 if quick else None]]
        surfaces = [case.surfaces(SURFACES) for case in cases]
        for label in surfaces[0]:
            own = [(case, made[label]) for case, made in zip(cases, surfaces, strict=True)]
            ratios.append([name, label, *_lag_ratios(own)])
            steps.append([name, label, *_steps(own), _slope_step(own), f"{_rmse(own):.2f}"])
    return "\n\n".join(
        [
            "### Natural roughness: `fill --natural-roughness`",
            f"Voids of more than {LARGE} cells, seeds {', '.join(map(str, SEEDS))} pooled. "
            "Structure function D(h) = mean (z(p + h) − z(p))² of pairs inside a void ÷ that of "
            f"the known pairs within {MARGIN} cells of its bounding box, at lags h in cells; sums "
            "over voids weighted by their pairs, and in brackets the median void's.",
            table(["tile", "surface", *(f"h = {lag}" for lag in LAGS)], ratios),
            "Mean step [m] between neighbouring cells across the rim and inside; mean change of "
            "slope (second difference) of three cells across the rim ÷ that of the known ground "
            f"within {MARGIN} cells; and the price: RMSE [m] of all void cells.",
            table(
                [
                    "tile",
                    "surface",
                    "across the rim",
                    "inside",
                    "rim ÷ inside",
                    "slope step, rim ÷ around",
                    "RMSE",
                ],
                steps,
            ),
        ]
    )


def _lag_ratios(own):
    """Give the structure function inside ÷ around at each lag, over all voids and the median."""
    out = []
    for lag in LAGS:
        inside, around, pairs = (
            np.concatenate(part)
            for part in zip(*(_structure(case, z, lag) for case, z in own), strict=True)
        )
        usable = (pairs > 0) & (around > 0)
        inside, around, pairs = inside[usable], around[usable], pairs[usable]
        whole = (inside * pairs).sum() / (around * pairs).sum()
        out.append(f"**{whole:.2f}** ({np.median(inside / around):.2f})")
    return out


def _structure(case, z, lag):
    """Give D inside each large void, D around it, and the number of pairs inside."""
    count = int(case.large.max())
    squares, pairs = np.zeros(count + 1), np.zeros(count + 1)
    for (a, b), (in_a, in_b) in zip(_pairs(z, lag), _pairs(case.large, lag), strict=True):
        same = (in_a == in_b) & (in_a > 0)
        squares += np.bincount(in_a[same], (a - b)[same] ** 2, count + 1)
        pairs += np.bincount(in_a[same], minlength=count + 1)
    inside = squares[1:] / np.maximum(pairs[1:], 1)
    around = np.array([_around(case, box, lag) for box in find_objects(case.large)])
    return inside, around, pairs[1:]


def _around(case, box, lag):
    """Give D of the known ground around a void with this bounding box."""
    wide = tuple(slice(max(side.start - MARGIN, 0), side.stop + MARGIN) for side in box)
    z, known = case.truth[wide].astype(np.float64), ~case.void[wide]
    squares = [
        ((a - b) ** 2)[known_a & known_b]
        for (a, b), (known_a, known_b) in zip(_pairs(z, lag), _pairs(known, lag), strict=True)
    ]
    return np.concatenate(squares).mean()


def _pairs(array, lag):
    """Give the cells that are ``lag`` apart, north-south and east-west."""
    return (array[:-lag], array[lag:]), (array[:, :-lag], array[:, lag:])


def _steps(own):
    """Give the mean step across rims, that inside, and their ratio."""
    rim, inside = [], []
    for case, z in own:
        pairs = zip(_pairs(z, 1), _pairs(case.large, 1), _pairs(case.void, 1), strict=True)
        for (a, b), (in_a, in_b), (void_a, void_b) in pairs:
            step = abs(a - b)
            rim.append(step[((in_a > 0) & ~void_b) | ((in_b > 0) & ~void_a)])
            inside.append(step[(in_a > 0) & (in_b > 0)])
    across, within = (float(np.concatenate(part).mean()) for part in (rim, inside))
    return f"{across:.2f}", f"{within:.2f}", f"**{across / within:.2f}**"


def _slope_step(own):
    """Give the mean change of slope across rims ÷ that of the known ground around."""
    rim, around = [], []
    for case, z in own:
        surroundings = case.surroundings
        for axis in (0, 1):
            change = abs(np.diff(z, 2, axis))
            inside, known = (_triples(cells, axis) for cells in (case.large > 0, surroundings))
            rim.append(change[(sum(inside) > 0) & (sum(known) > 0)])
            around.append(change[sum(known) == 3])
    across, outside = (float(np.concatenate(part).mean()) for part in (rim, around))
    return f"**{across / outside:.2f}**"


def _triples(cells, axis):
    """Give, as 0 and 1, the first, second and third of three neighbouring cells in a line."""
    cells = np.moveaxis(cells.astype(np.int8), axis, 0)
    return [np.moveaxis(part, 0, axis) for part in (cells[:-2], cells[1:-1], cells[2:])]


def _rmse(own):
    squares = [(z - case.truth)[case.void] ** 2 for case, z in own]
    return float(np.sqrt(np.concatenate(squares).mean()))


# --- axes ----------------------------------------------------------------------------------------


def axes(quick):
    """Compare the energy of gradients along the lattice's axes with that along its diagonals."""
    rows = []
    for name in _tiles(quick):
        ratios = {}
        for seed in SEEDS[: 1 if quick else None]:
            case = Punched.of(name, seed)
            for label, z in case.surfaces(AXIS_SURFACES).items():
                ratios.setdefault(label, []).append(_axis_ratios(case, z))
        for label, values in ratios.items():
            by_direction, by_steps = np.mean(values, axis=0)
            rows.append([name, label, f"**{by_direction:.2f}**", f"{by_steps:.2f}"])
    return (
        "### Axis artefacts\n\n"
        f"Gradient energy along the axes ÷ along the diagonals inside voids of more than {LARGE} "
        "cells, relative to the same of the known ground around them, mean of seeds "
        f"{', '.join(map(str, SEEDS))}. *By direction*: energy of the gradients (central "
        "differences) that point within 22.5° of an axis ÷ that of the others. *By steps*: mean "
        "squared slope of steps to the next cell ÷ of diagonal steps. Diagonal steps are longer, "
        "so this second ratio also falls where the fill is smoother than the ground.\n\n"
        + table(["tile", "surface", "by direction", "by steps"], rows)
    )


def _axis_ratios(case, z):
    inside, around = case.large > 0, case.surroundings
    return [
        ratio(z, inside, *case.sizes) / ratio(z, around, *case.sizes)
        for ratio in (_by_direction, _by_steps)
    ]


def _by_direction(z, cells, dx, dy):
    middle = np.s_[1:-1, 1:-1]
    east = (z[1:-1, 2:] - z[1:-1, :-2]) / (2 * dx[1:-1, None])
    south = (z[2:, 1:-1] - z[:-2, 1:-1]) / (2 * dy[1:-1, None])
    whole = cells[middle] & cells[1:-1, 2:] & cells[1:-1, :-2] & cells[2:, 1:-1] & cells[:-2, 1:-1]
    east, south = abs(east[whole]), abs(south[whole])
    energy = east**2 + south**2
    along = np.minimum(east, south) < np.tan(np.pi / 8) * np.maximum(east, south)
    return energy[along].sum() / energy[~along].sum()


def _by_steps(z, cells, dx, dy):
    across = np.hypot(dx, dy)[:-1, None]
    straight = _energy(z, cells, np.s_[:, :-1], np.s_[:, 1:], dx[:, None])
    straight += _energy(z, cells, np.s_[:-1], np.s_[1:], dy[:-1, None])
    diagonal = _energy(z, cells, np.s_[:-1, :-1], np.s_[1:, 1:], across)
    diagonal += _energy(z, cells, np.s_[:-1, 1:], np.s_[1:, :-1], across)
    return straight / diagonal


def _energy(z, cells, one, other, distance):
    """Give the mean squared slope of steps from one to the other, both among the cells."""
    return (((z[one] - z[other]) / distance)[cells[one] & cells[other]] ** 2).mean()


def _tiles(quick):
    return list(tiles.VOID_FREE)[: 1 if quick else None]

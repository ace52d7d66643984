"""The options of inverse procedural modelling."""

from dataclasses import dataclass

from demsmith.core.noise import FAMILIES, MOST_TERMS
from demsmith.core.options import option

MIXED = "mixed"
"""Family of a dictionary that has functions of all families."""

MOST_ATOMS = 65_536


@dataclass(frozen=True, kw_only=True)
class ProceduralizeOptions:
    """With which functions terrain is modelled, and how closely."""

    family: str = option(
        str, "ridged", "Family of noise",
        "ridged: noise with sharp crests, which suits mountains best; perlin: smooth noise; "
        "multifractal: ridged noise that is rough on crests and smooth in valleys; mixed: some of "
        "each, of which those that fit are taken.",
        choices=("ridged", "perlin", "multifractal", MIXED),
    )  # fmt: skip
    atoms: int = option(
        int, 128, "Atoms",
        "Number of functions in the model's dictionary.",
        minimum=1, maximum=4096,
    )  # fmt: skip
    sparsity: int = option(
        int, 2, "Atoms of a disc",
        "How many functions are summed in a disc, besides its mean: more follow the terrain more "
        "closely.",
        minimum=1, maximum=16,
    )  # fmt: skip
    radius: float | None = option(
        float, None, "Radius of discs [m]",
        "Radius of a disc in metres on the ground. Not given: 5 cells.",
        minimum=1e-6,
    )  # fmt: skip
    candidates: int = option(
        int, 4096, "Candidates",
        "Number of random functions among which the dictionary is chosen, by what they explain of "
        "the terrain.",
        minimum=1, maximum=MOST_ATOMS, advanced=True,
    )  # fmt: skip
    terms: int = option(
        int, 2, "Noises of a function",
        "A function is a sum of so many noises, each with an amplitude and a wavelength of its "
        "own.",
        minimum=1, maximum=MOST_TERMS, advanced=True,
    )  # fmt: skip
    seed: int = option(
        int, 0, "Random seed",
        "The same seed makes the same candidates.",
        minimum=0, maximum=2**31 - 1, advanced=True,
    )  # fmt: skip

    def families(self):
        """Give the families that candidates take turns to be of, by number."""
        if self.family == MIXED:
            return tuple(range(len(FAMILIES)))
        return (FAMILIES.index(self.family),)


@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """At what resolution a model is evaluated."""

    scale: float = option(
        float, 1.0, "Cells along a cell",
        "Resolution of the evaluated raster: its cells along a cell of the modelled raster. 4 "
        "gives four times the resolution, 0.5 half of it.",
        minimum=0.001, maximum=1000,
    )  # fmt: skip

"""The options of learning a dictionary."""

from dataclasses import dataclass

from demsmith.core.options import option
from demsmith.core.sparse.dictionary import LARGEST_FACTOR
from demsmith.core.sparse.dictionary_file import PRECISIONS
from demsmith.core.sparse.pursuit import LARGEST_SPARSITY

METHODS = ("ksvd", "constrained", "complete")
WEIGHTINGS = ("blend", "even")


@dataclass(frozen=True, kw_only=True)
class LearnOptions:
    """What kind of dictionary is learned, and how."""

    method: str = option(
        str, "ksvd", "Method",
        "ksvd: atoms are free shapes, which represent terrain best; constrained: every atom is one "
        "of the terrain's own discs, as synthesis needs it; complete: all discs are atoms.",
        choices=METHODS,
    )  # fmt: skip
    atoms: int = option(
        int, 128, "Atoms",
        "Number of atoms; a complete dictionary has as many as there are discs.",
        minimum=1, maximum=1 << 20,
    )  # fmt: skip
    sparsity: int = option(
        int, 2, "Atoms of a disc",
        "How many atoms may be summed to represent a disc: learn with what the dictionary is "
        "used with.",
        minimum=1, maximum=LARGEST_SPARSITY,
    )  # fmt: skip
    radius: float | None = option(
        float, None, "Radius of discs [m]",
        "Radius of a disc in metres on the ground. Not given: 5 cells of the coarser resolution.",
        minimum=1e-6,
    )  # fmt: skip
    factor: int = option(
        int, 1, "Cells of the finer resolution along a coarse one",
        "Above 1 a dictionary of two resolutions is made, for amplification: the exemplar's own, "
        "and one so many times coarser, over which terrain is decomposed.",
        minimum=1, maximum=LARGEST_FACTOR,
    )  # fmt: skip
    iterations: int = option(
        int, 30, "Iterations",
        "Rounds of pursuit and replacement, at most; learning ends before when it no longer pays.",
        minimum=1, maximum=10_000, advanced=True,
    )  # fmt: skip
    polishing: int = option(
        int, 5, "Rounds of polishing",
        "Rounds in which the atoms of ksvd are fitted to the blend of discs, at most; only with "
        "weighting blend and one resolution.",
        minimum=0, maximum=1000, advanced=True,
    )  # fmt: skip
    tolerance: float = option(
        float, 0.0, "Error that is low enough [m]",
        "Learning ends when the root mean square error of the discs is no larger.",
        minimum=0, advanced=True,
    )  # fmt: skip
    most_discs: int = option(
        int, 50_000, "Discs to learn from, at most",
        "Where the exemplars have more, so many are chosen at random. A complete dictionary has "
        "all.",
        minimum=1, maximum=1 << 24, advanced=True,
    )  # fmt: skip
    weighting: str = option(
        str, "blend", "Weighting of errors",
        "blend: errors count as much as in the blend of overlapping discs; even: the same all "
        "over a disc, as in the paper.",
        choices=WEIGHTINGS, advanced=True,
    )  # fmt: skip
    seed: int = option(
        int, 0, "Random seed",
        "The same seed learns the same dictionary.",
        minimum=0, maximum=2**31 - 1, advanced=True,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class StoreOptions:
    """How a dictionary is stored."""

    precision: str = option(
        str, "float32", "Precision of samples",
        "float32: as learned; float16: half as large, relative error up to 0.0005; int8: a quarter "
        "as large, error up to 0.004 of the atom's largest. What is stored as places is exact.",
        choices=PRECISIONS, advanced=True,
    )  # fmt: skip

"""The options of validation."""

from dataclasses import dataclass

from demsmith.core.options import option


@dataclass(frozen=True, kw_only=True)
class ValidateOptions:
    """How much known ground is hidden, and how often."""

    share: float = option(
        float, 0.05, "Share of cells to hide",
        "Share of the known cells that is hidden in artificial voids at a time, as a fraction "
        "of 1.",
        minimum=0.001, maximum=0.5,
    )  # fmt: skip
    seeds: int = option(
        int, 3, "Masks",
        "How many masks of artificial voids are tried; their errors are pooled.",
        minimum=1, maximum=100,
    )  # fmt: skip
    seed: int = option(
        int, 0, "Random seed",
        "Seed of the first mask; the others have the seeds after it.",
        minimum=0, maximum=2**31 - 1,
    )  # fmt: skip

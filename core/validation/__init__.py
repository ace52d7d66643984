"""Judging fills: artificial voids on known ground, and how wrong each method is there."""

from demsmith.core.validation.job import ValidateResult, validate_file
from demsmith.core.validation.methods import METHODS
from demsmith.core.validation.options import ValidateOptions
from demsmith.core.validation.punching import punch_voids
from demsmith.core.validation.scoring import SIZE_CLASSES, Holes, SizeError, Tally, errors_by_size
from demsmith.core.validation.shapes import VoidShape, void_shapes
from demsmith.core.validation.transplanting import single_holes, transplant_voids
from demsmith.core.validation.validation import MethodScore, Validation, validate

__all__ = [
    "METHODS",
    "SIZE_CLASSES",
    "Holes",
    "MethodScore",
    "SizeError",
    "Tally",
    "ValidateOptions",
    "ValidateResult",
    "Validation",
    "VoidShape",
    "errors_by_size",
    "punch_voids",
    "single_holes",
    "transplant_voids",
    "validate",
    "validate_file",
    "void_shapes",
]

"""Reports: one page with pictures and charts that needs no other file, and its numbers as JSON."""

from demsmith.core.report.blocks import (
    Chart,
    Column,
    Facts,
    Gallery,
    Note,
    Numbers,
    Picture,
    Section,
    Table,
    table_of,
)
from demsmith.core.report.comparison import Comparison, comparison_blocks
from demsmith.core.report.reconstruction import (
    expected_error,
    reconstruction_report,
    striking_voids,
)
from demsmith.core.report.report import Report
from demsmith.core.report.scene import Scene

__all__ = [
    "Chart",
    "Column",
    "Comparison",
    "Facts",
    "Gallery",
    "Note",
    "Numbers",
    "Picture",
    "Report",
    "Scene",
    "Section",
    "Table",
    "comparison_blocks",
    "expected_error",
    "reconstruction_report",
    "striking_voids",
    "table_of",
]

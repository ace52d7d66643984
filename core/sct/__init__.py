"""Sparse Construction Tree files (`.sct`): rasters in little space, within a guaranteed error."""

from demsmith.core.sct.file import SctFile, open_sct
from demsmith.core.sct.info import Info, info_file
from demsmith.core.sct.job import (
    CompressResult,
    DecompressResult,
    compress_file,
    decompress_file,
)
from demsmith.core.sct.options import CompressOptions, DecompressOptions
from demsmith.core.sct.scaling import decoded_at

__all__ = [
    "CompressOptions",
    "CompressResult",
    "DecompressOptions",
    "DecompressResult",
    "Info",
    "SctFile",
    "compress_file",
    "decoded_at",
    "decompress_file",
    "info_file",
    "open_sct",
]

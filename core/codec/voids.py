"""The voids of a raster, tile by tile, without loss."""

from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.codec import _mask
from demsmith.core.codec._coder import buffer_for, coding_room
from demsmith.core.progress import SILENT


def encode_voids(void, tiling, *, threads=None, progress=SILENT):
    """Code which cells are void.

    Parameters
    ----------
    void : bool (H, W)
    tiling : Tiling
    threads, progress
        As everywhere.

    Returns
    -------
    list of bytes
        One part for each tile; empty for a tile without voids.
    """
    parts = [b""] * tiling.count

    def encode(tile):
        mask = void[tiling.slices(tile)]
        if mask.any():
            room, data = coding_room(_mask.STATES, 1, 1), buffer_for(mask.size)
            _mask.code_mask(np.pad(mask, 2).astype(np.uint8), data=data, decoding=False, **room)
            # A part of zeros alone would be cut to nothing, which means no voids.
            parts[tile] = data[: max(room["coder"][3], 1)].tobytes()

    parallel.run(
        [partial(encode, tile) for tile in range(tiling.count)], threads=threads, progress=progress
    )
    return parts


def decode_voids(shape, part):
    """Give the voids of a tile of ``shape`` cells from its part, as a bool array."""
    mask = np.zeros((shape[0] + 4, shape[1] + 4), np.uint8)
    if part:
        room = coding_room(_mask.STATES, 1, 1)
        data = np.frombuffer(part, np.uint8)
        _mask.code_mask(mask, data=data, decoding=True, **room)
    return mask[2:-2, 2:-2].astype(bool)

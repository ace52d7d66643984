"""What is known of the catchment of each cell: whether it is whole, and of surveyed ground."""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.hydrology.codes import CHANGED, EDGE, FILLED
from demsmith.core.hydrology.traversal import in_strips
from demsmith.core.progress import SILENT, Span, checkpoint

_PATIENCE = 1 << 22
_ROOM = 1 << 16


def contamination(receivers, void, *, filled=None, changed=None, threads=None, progress=SILENT):
    """Tell what the catchment of each cell holds.

    Parameters
    ----------
    receivers : (H, W) uint8 array
        D8 codes, as `demsmith.core.hydrology.d8_directions` gives them; for a method by which water
        parts, sums of the codes of all neighbours that get a share, as
        `demsmith.core.hydrology.traversal.Surface.receivers` gives them.
    void : (H, W) bool array
        True where there is no elevation.
    filled, changed : (H, W) bool array, optional
        Cells filled before; cells that the treatment of depressions changed.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) uint8 array
        Sum of 1 where the catchment, of which the cell is part, touches the raster's edge or a
        void, so that there may be more of it; 2 where it holds a filled cell; 4 where it holds a
        changed one. 0 at voids.

    Raises
    ------
    InputError
        If the arrays do not fit.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    Water flows east; what comes from the edge is not the whole:

    >>> contamination(np.full((3, 4), 1, np.uint8), np.zeros((3, 4), bool))[1]
    array([1, 1, 1, 1], dtype=uint8)
    """
    from demsmith.core.hydrology import _contamination as kernels

    receivers, void = np.ascontiguousarray(receivers), np.ascontiguousarray(void, bool)
    if receivers.dtype != np.uint8 or receivers.shape != void.shape:
        raise InputError(
            f"directions have shape {receivers.shape} of {receivers.dtype}, the voids "
            f"{void.shape}; give uint8 of the same shape"
        )
    flags = np.zeros(void.shape, np.uint8)
    for mask, name, flag in ((filled, "filled", FILLED), (changed, "changed", CHANGED)):
        if mask is None:
            continue
        if mask.shape != void.shape:
            raise InputError(f"{name} has shape {mask.shape}, the voids {void.shape}")
        flags |= (mask & ~void) * np.uint8(flag)
    in_strips(
        lambda rows: kernels.mark_edges(void, np.uint8(EDGE), rows.start, rows.stop, flags),
        void.shape, threads=threads, progress=Span(progress, 0, 0.2),
    )  # fmt: skip
    place, stack = np.zeros(2, np.int64), np.empty(_ROOM, np.int64)
    while not kernels.spread(receivers, void, void.size, _PATIENCE, place, stack, flags):
        checkpoint(progress, 0.2 + 0.8 * place[0] / void.size)
        if place[1] > stack.size // 2:
            stack = np.concatenate([stack, np.empty_like(stack)])
    checkpoint(progress, 1)
    return flags

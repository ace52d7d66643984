"""What streams know before their first decision: learned from other terrain.

A tile is coded apart from all others, so that it has little time to learn; states and weights
begin as they were after many tiles of public-domain terrain (``tools/train_priors.py`` makes
``priors.npz``). They are part of the format: files made with one set are read with that set.
"""

from functools import cache
from pathlib import Path

import numpy as np

from demsmith.core.codec._coder import FRESH

_PATH = Path(__file__).with_name("priors.npz")
TIMES = 24
"""How often a learned state counts as met, at the most: it still learns quickly."""


def primed(name, room):
    """Let a stream's states and weights begin as learned; give the ``room`` again.

    Parameters
    ----------
    name : str
        ``residual`` or ``details``.
    room : dict
        From `coding_room`.
    """
    states, weights = _learned(name)
    if states.size:
        room["states"][:] = states
        room["weights"][:] = weights
    return room


@cache
def _learned(name):
    if not _PATH.exists():  # only before `tools/train_priors.py` made it
        return np.empty(0, np.int32), np.empty((0, 0), np.float32)
    with np.load(_PATH, allow_pickle=False) as arrays:
        chances, times = arrays[f"{name}_chances"], arrays[f"{name}_times"]
        weights = arrays[f"{name}_weights"].astype(np.float32)
    states = (chances.astype(np.int32) << 15) | times
    return np.where(times > 0, states, FRESH).astype(np.int32), weights


def kept(states, weights):
    """Give states and weights after training as arrays to keep: ``chances, times, weights``.

    A state's chance is kept to 16 bits, which is more than one that goes on to learn can use.
    """
    times = np.minimum(states & 1023, TIMES).astype(np.uint8)
    chances = np.clip(states >> 15, 1, 65535).astype(np.uint16)
    return np.where(times > 0, chances, 0).astype(np.uint16), times, weights.astype(np.float16)

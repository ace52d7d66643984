"""Row blocks and voids side by side in threads, with progress and cancel."""

import os
import threading
from collections import deque
from itertools import pairwise

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint


def thread_count(threads=None):
    """Give the number of threads to use: ``threads``, or one for each core if None.

    Raises
    ------
    InputError
        If ``threads`` is less than 1.
    """
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    if threads < 1:
        raise InputError(f"threads is {threads}; it must be at least 1")
    return int(threads)


def run(tasks, *, threads=None, progress=SILENT, weights=None):
    """Call every task, a function without arguments, in ``threads`` threads.

    Tasks must be independent of each other, so that the result does not depend on ``threads``.
    The calling thread does its share, for a new one may take milliseconds to begin.

    Parameters
    ----------
    tasks : list of callable
        Each should take well under half a second: progress and cancel come between them.
    threads : int, optional
        Default: one for each core.
    progress : Progress
        Told the share of the tasks, by ``weights``, that are done.
    weights : sequence of float, optional
        How much work each task is; default: the same for all.

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop; tasks not begun are dropped, those begun are waited for.
    """
    tasks = list(tasks)
    weights = [1.0] * len(tasks) if weights is None else [float(weight) for weight in weights]
    waiting = deque(zip(tasks, weights, strict=True))
    done, errors = [], []
    total = sum(weights) or 1.0

    def help_out():
        try:
            while not errors and _do_next(waiting, done):
                pass
        except BaseException as error:  # it is raised again in the calling thread
            errors.append(error)

    helpers = [
        threading.Thread(target=help_out, daemon=True)
        for _ in range(min(thread_count(threads), len(tasks)) - 1)
    ]
    try:
        for helper in helpers:
            helper.start()
        while waiting and not errors:
            _check(progress, done, total)
            _do_next(waiting, done)
        for helper in helpers:
            while helper.is_alive():
                helper.join(0.2)
                _check(progress, done, total)
    finally:
        waiting.clear()
        for helper in helpers:
            if helper.ident is not None:
                helper.join()
    if errors:
        raise errors[0]
    if tasks:
        _check(progress, done, total)


def _do_next(waiting, done):
    """Do the next task that waits; tell whether there was one."""
    try:
        task, weight = waiting.popleft()
    except IndexError:
        return False
    task()
    done.append(weight)
    return True


def _check(progress, done, total):
    checkpoint(progress, min(sum(done) / total, 1.0))


def even_spans(weights, parts):
    """Cut a list into at most ``parts`` spans of about the same weight.

    Parameters
    ----------
    weights : (N,) array of positive numbers
    parts : int

    Returns
    -------
    list of (int, int)
        First index and one past the last of each span; all indices are in one of them.

    Examples
    --------
    >>> even_spans(np.array([5, 1, 1, 1, 2]), 2)
    [(0, 1), (1, 5)]
    """
    if weights.size == 0:
        return []
    total = np.cumsum(weights)
    cuts = np.searchsorted(total, total[-1] * np.arange(1, parts) / parts, side="left") + 1
    edges = np.unique(np.concatenate([[0], np.minimum(cuts, weights.size), [weights.size]]))
    return [(int(a), int(b)) for a, b in pairwise(edges)]

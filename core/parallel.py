"""Row blocks and voids side by side in threads, with progress and cancel."""

import os
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from itertools import pairwise

import numpy as np

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.progress import SILENT


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
    weights = [1.0] * len(tasks) if weights is None else weights
    total, done = float(sum(weights)) or 1.0, 0.0
    workers = min(thread_count(threads), len(tasks))
    if workers <= 1:
        for task, weight in zip(tasks, weights, strict=True):
            if progress.cancelled():
                raise Cancelled()
            task()
            done += float(weight)
            progress.report(min(done / total, 1.0))
        return
    with ThreadPoolExecutor(workers) as pool:
        pending = {
            pool.submit(task): float(weight) for task, weight in zip(tasks, weights, strict=True)
        }
        try:
            while pending:
                finished, _ = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in finished:
                    done += pending.pop(future)
                    future.result()
                if progress.cancelled():
                    raise Cancelled()
                progress.report(min(done / total, 1.0))
        finally:
            for future in pending:
                future.cancel()


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

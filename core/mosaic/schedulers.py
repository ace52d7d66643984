"""Where the tasks of a mosaic run: in this process, in processes of this machine, on a cluster.

A task leaves its result in a file, which appears whole or not at all; so a task whose file is
there is done, whoever did it and whatever became of that one.
"""

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from dataclasses import dataclass

from demsmith.core.errors import DemsmithError, DependencyError, InputError
from demsmith.core.parallel import thread_count
from demsmith.core.progress import Span, checkpoint

DEATHS = 3
"""So many workers may die of a task before it is given up."""

_LOOK = 0.2  # seconds between two looks at whether the user wants to stop
_MOST_PROCESSES = 61  # Windows waits for no more


@dataclass(frozen=True, eq=False)
class Task:
    """A piece of work for a worker.

    Attributes
    ----------
    name : str
        What it is about, for messages.
    function : callable
        Of a module, so that its name is enough to find it in another process. Called with
        ``args``, and ``threads`` and ``progress``.
    args : tuple
    result : str
        The file it makes.
    """

    name: str
    function: object
    args: tuple
    result: str


class StopFile:
    """A `Progress` that asks to stop when a file is there, which every worker can see."""

    def __init__(self, path):
        self._path = path
        self._looked = 0.0

    def report(self, fraction):
        """Report nothing."""

    def cancelled(self):
        """Tell whether the file is there; it is looked for five times a second."""
        now = time.monotonic()
        if now - self._looked < _LOOK:
            return False
        self._looked = now
        return os.path.exists(self._path)

    def ask(self):
        """Ask all workers to stop."""
        with contextlib.suppress(OSError), open(self._path, "wb"):
            pass


class InThisProcess(contextlib.nullcontext):
    """Does one task after the other, each in several threads.

    Parameters
    ----------
    threads : int, optional
        Default: one for each core.
    """

    def __init__(self, threads=None):
        super().__init__(self)
        self._threads = threads

    def run(self, tasks, *, stop, progress):
        """Do all tasks; see `Processes.run`."""
        for number, task in enumerate(tasks):
            part = Span(progress, number / len(tasks), (number + 1) / len(tasks))
            checkpoint(part, 0.0)
            task.function(*task.args, threads=self._threads, progress=part)


class Processes:
    """Does tasks side by side in processes of this machine, which live as long as the context.

    Each process is a pool of its own, for the death of one breaks its pool.

    Parameters
    ----------
    workers : int, optional
        Default: one for each core.
    threads : int
        Of each worker.
    """

    def __init__(self, workers=None, threads=1):
        self._workers = min(workers or thread_count(), _MOST_PROCESSES)
        self._threads = threads
        self._pools = []
        self._idle = []

    def __enter__(self):
        return self

    def __exit__(self, *failure):
        for pool in self._pools:
            pool.shutdown(wait=False, cancel_futures=True)
        for pool in self._pools:
            pool.shutdown(wait=True)

    def run(self, tasks, *, stop, progress):
        """Do all tasks, in any order.

        Parameters
        ----------
        tasks : list of Task
        stop : StopFile
            By which the workers are asked to stop.
        progress : Progress

        Raises
        ------
        DemsmithError
            What a task raised; or if so many workers died of one.
        Cancelled
            If ``progress`` asks to stop.
        """
        from concurrent.futures import FIRST_COMPLETED, wait

        waiting, running, deaths = deque(tasks), {}, dict.fromkeys(tasks, 0)
        try:
            while waiting or running:
                while waiting and len(running) < self._workers:
                    task, pool = waiting.popleft(), self._free_pool()
                    running[self._submit(pool, task, stop)] = task, pool
                for future in wait(running, timeout=_LOOK, return_when=FIRST_COMPLETED).done:
                    task, pool = running.pop(future)
                    if not self._is_done(future, task, pool):
                        deaths[task] += 1
                        _refuse_deadly(task, deaths[task])
                        waiting.append(task)
                checkpoint(progress, 1 - (len(waiting) + len(running)) / len(tasks))
        except BaseException:
            stop.ask()
            raise

    def _free_pool(self):
        from concurrent.futures import ProcessPoolExecutor

        if not self._idle:
            spawn = multiprocessing.get_context("spawn")
            pool = ProcessPoolExecutor(1, mp_context=spawn, initializer=_begin_worker)
            self._pools.append(pool)
            return pool
        return self._idle.pop()

    def _submit(self, pool, task, stop):
        from concurrent.futures import Future
        from concurrent.futures.process import BrokenProcessPool

        try:
            return pool.submit(task.function, *task.args, threads=self._threads, progress=stop)
        except BrokenProcessPool as death:  # it died while it was idle
            future = Future()
            future.set_exception(death)
            return future

    def _is_done(self, future, task, pool):
        """Tell whether a task was done, and keep its process, or bury it."""
        from concurrent.futures.process import BrokenProcessPool

        try:
            future.result()
        except BrokenProcessPool:
            pool.shutdown(wait=True)
            self._pools.remove(pool)
            return os.path.exists(task.result)
        self._idle.append(pool)
        return True


def _refuse_deadly(task, deaths):
    if deaths == DEATHS:
        raise DemsmithError(
            f"{DEATHS} worker processes died at {task.name}; if they were killed for want of "
            "memory, run fewer (--workers)"
        )


def _begin_worker():
    """Leave Ctrl-C to the process that has the user, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def follow():
        parent.join()
        os._exit(1)  # in the midst of a task, whose result then is not there

    threading.Thread(target=follow, daemon=True).start()


class DaskCluster(contextlib.nullcontext):
    """Does tasks on a Dask cluster, whose machines see the files under the same paths.

    Parameters
    ----------
    address : str
        Of its scheduler: ``tcp://host:port``.
    """

    def __init__(self, address):
        super().__init__(self)
        self._address = address

    def run(self, tasks, *, stop, progress):
        """Do all tasks; see `Processes.run`."""
        with self._client() as client:
            futures = {}
            try:
                for task in tasks:
                    future = client.submit(
                        task.function, *task.args, threads=1, progress=stop, pure=False
                    )
                    futures[future] = task
                self._wait(futures, progress)
            except BaseException:
                stop.ask()
                client.cancel(list(futures))
                raise

    def _wait(self, futures, progress):
        left = set(futures)
        while left:
            done = {future for future in left if future.done()}
            for future in done:
                self._check(future, futures[future])
            left -= done
            checkpoint(progress, 1 - len(left) / len(futures))
            if left and not done:
                time.sleep(_LOOK)

    def _check(self, future, task):
        from distributed import KilledWorker

        try:
            future.result()
        except KilledWorker:
            raise DemsmithError(f"too many workers of the cluster died at {task.name}") from None

    def _client(self):
        try:
            from distributed import Client
        except ImportError:
            raise DependencyError(
                "a Dask cluster needs the package distributed: pip install demsmith[distributed]"
            ) from None
        try:
            return Client(self._address, timeout=10, set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError(
                f"no Dask scheduler answers at '{self._address}' ({error or 'time ran out'})"
            ) from None

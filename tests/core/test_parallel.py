"""Work side by side in threads: every task once, progress, cancel, errors, even cuts."""

import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from demsmith.core import parallel
from demsmith.core.errors import Cancelled, InputError


class Recorder:
    def __init__(self, cancel_after=None):
        self.fractions, self.cancel_after, self.threads = [], cancel_after, set()

    def report(self, fraction):
        self.fractions.append(fraction)
        self.threads.add(threading.get_ident())

    def cancelled(self):
        self.threads.add(threading.get_ident())
        return self.cancel_after is not None and len(self.fractions) >= self.cancel_after


@pytest.mark.parametrize("threads", [1, 2, 7])
@pytest.mark.parametrize("count", [0, 1, 5, 100])
def test_every_task_runs_once(count, threads):
    done, lock = [], threading.Lock()

    def task(n):
        with lock:
            done.append(n)

    show = Recorder()
    parallel.run([lambda n=n: task(n) for n in range(count)], threads=threads, progress=show)
    assert sorted(done) == list(range(count))
    if count:
        assert show.fractions == sorted(show.fractions)
        assert show.fractions[-1] == pytest.approx(1)


@pytest.mark.parametrize("threads", [1, 3])
def test_weights_share_the_progress(threads):
    show = Recorder()
    tasks = [lambda: time.sleep(0.01)] * 3
    parallel.run(tasks, threads=threads, progress=show, weights=np.array([7, 2, 1]))
    assert show.fractions[-1] == pytest.approx(1)
    if threads == 1:
        assert show.fractions == pytest.approx([0, 0.7, 0.9, 1])


def test_weights_of_nought_do_no_harm():
    show = Recorder()
    parallel.run([lambda: None] * 2, progress=show, weights=[0, 0])
    assert all(0 <= fraction <= 1 for fraction in show.fractions)


def test_one_weight_for_each_task():
    with pytest.raises(ValueError, match="zip"):
        parallel.run([lambda: None] * 3, weights=[1, 2], threads=1)
    with pytest.raises(ValueError, match="zip"):
        parallel.run([lambda: None] * 3, weights=[1, 2], threads=2)


@pytest.mark.parametrize("threads", [1, 3])
def test_progress_is_told_in_the_callers_thread(threads):
    show = Recorder()
    parallel.run([lambda: time.sleep(0.01)] * 20, threads=threads, progress=show)
    assert show.threads == {threading.get_ident()}


@pytest.mark.parametrize("threads", [1, 3])
def test_cancel_drops_what_has_not_begun(threads):
    begun = []
    tasks = [lambda n=n: (begun.append(n), time.sleep(0.02)) for n in range(200)]
    start = time.perf_counter()
    with pytest.raises(Cancelled):
        parallel.run(tasks, threads=threads, progress=Recorder(cancel_after=2))
    assert time.perf_counter() - start < 1
    count = len(begun)
    assert count < 30
    time.sleep(0.1)
    assert len(begun) == count  # those begun were waited for


def test_cancel_is_heard_while_others_work():
    """The caller, done with its share, looks up five times a second though no task ends."""

    class Later:
        begin = time.perf_counter()
        asked = 0

        def report(self, fraction):
            pass

        def cancelled(self):
            self.asked += 1
            return time.perf_counter() - self.begin > 0.3

    later, here = Later(), threading.get_ident()
    tasks = [lambda: time.sleep(0 if threading.get_ident() == here else 0.8)] * 8
    with pytest.raises(Cancelled):
        parallel.run(tasks, threads=2, progress=later)
    assert later.asked >= 9


@pytest.mark.parametrize("threads", [1, 3])
def test_an_error_comes_through_and_stops_the_rest(threads):
    done = []

    def fail():
        raise ZeroDivisionError("in a task")

    with pytest.raises(ZeroDivisionError, match="in a task"):
        parallel.run([fail] + [lambda: (done.append(1), time.sleep(0.02))] * 100, threads=threads)
    assert len(done) < 20


def test_tasks_do_run_side_by_side():
    barrier = threading.Barrier(2, timeout=5)
    parallel.run([barrier.wait, barrier.wait], threads=2)


def test_thread_count():
    assert parallel.thread_count() >= 1
    assert parallel.thread_count(3) == 3
    for threads in (0, -1):
        with pytest.raises(InputError, match=f"threads is {threads}; it must be at least 1"):
            parallel.thread_count(threads)


@given(st.lists(st.integers(1, 1000), max_size=60), st.integers(1, 20))
def test_spans_cover_all_and_are_even(weights, parts):
    weights = np.array(weights, np.int64)
    spans = parallel.even_spans(weights, parts)
    assert len(spans) <= parts
    assert [n for begin, end in spans for n in range(begin, end)] == list(range(weights.size))
    assert all(begin < end for begin, end in spans)
    if weights.size:
        even = weights.sum() / parts
        # A span passes the even share by no more than the weights at its two ends.
        for begin, end in spans:
            assert weights[begin:end].sum() <= even + 2 * weights.max()

"""Progress: parts of parts add up, and the wish to stop comes through."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from demsmith.core.errors import Cancelled, DemsmithError
from demsmith.core.progress import SILENT, Muted, Progress, Span, checkpoint


class Recorder:
    def __init__(self, stop=False):
        self.fractions, self.stop = [], stop

    def report(self, fraction):
        self.fractions.append(fraction)

    def cancelled(self):
        return self.stop


def test_all_kinds_are_progress():
    for kind in (SILENT, Recorder(), Span(SILENT, 0, 1)):
        assert isinstance(kind, Progress)
    assert not isinstance(print, Progress)


def test_silent():
    SILENT.report(0.5)
    assert SILENT.cancelled() is False


@given(*[st.floats(0, 1)] * 5)
def test_span_in_a_span(a, b, c, d, fraction):
    (a, b), (c, d) = sorted((a, b)), sorted((c, d))
    show = Recorder()
    inner = Span(Span(show, a, b), c, d)
    inner.report(fraction)
    assert show.fractions == pytest.approx([a + (b - a) * (c + (d - c) * fraction)])
    assert a - 1e-12 <= show.fractions[0] <= b + 1e-12


@pytest.mark.parametrize("stop", [False, True])
def test_wish_to_stop_comes_through(stop):
    assert Span(Span(Recorder(stop), 0, 0.5), 0.5, 1).cancelled() is stop


def test_checkpoint():
    show = Recorder()
    checkpoint(show, 0.25)
    assert show.fractions == [0.25]
    show.stop = True
    with pytest.raises(Cancelled, match="cancelled; nothing was written"):
        checkpoint(show, 0.5)
    assert show.fractions == [0.25]


def test_cancelled_is_one_of_ours_and_no_failure():
    assert issubclass(Cancelled, DemsmithError)
    assert Cancelled().exit_status == 130


def test_muted_hears_cancel_and_reports_nothing():
    class Watched:
        told = ()
        stop = False

        def report(self, fraction):
            self.told = (*self.told, fraction)

        def cancelled(self):
            return self.stop

    watched = Watched()
    checkpoint(Muted(watched), 0.5)
    assert watched.told == ()
    watched.stop = True
    with pytest.raises(Cancelled):
        checkpoint(Muted(watched), 0.6)

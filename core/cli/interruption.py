"""Ctrl-C and its kin: the first asks the work to stop and clean up, the second kills."""

import contextlib
import signal
import threading

_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
_heard = []


@contextlib.contextmanager
def listening():
    """Hear signals that ask to stop, instead of dying of them, until the context ends.

    Does nothing outside the main thread, where Python cannot hear signals.
    """
    _heard.clear()
    before = {}
    if threading.current_thread() is threading.main_thread():
        # What is ignored stays ignored: nohup, or a job in the background of a script.
        before = {
            number: handler
            for number in _SIGNALS
            if (handler := signal.getsignal(number)) not in (signal.SIG_IGN, None)
        }
    try:
        for number in before:
            signal.signal(number, _hear)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def asked_to_stop():
    """Tell whether a signal asked the work to stop."""
    return bool(_heard)


def exit_status():
    """Exit status of work that was stopped: 128 + the signal's number, as shells have it."""
    return 128 + (_heard[0] if _heard else signal.SIGINT)


def _hear(number, frame):
    _heard.append(number)
    signal.signal(number, signal.SIG_DFL)

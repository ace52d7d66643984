"""The command line run inside the test's own process."""

from typing import NamedTuple

import pytest

from demsmith.core.cli import main


class Outcome(NamedTuple):
    status: int
    out: str
    err: str


@pytest.fixture
def demsmith(capfd):
    """Call the command line with these words; returns an `Outcome`."""

    def call(*words):
        capfd.readouterr()
        status = main([str(word) for word in words])
        return Outcome(status, *capfd.readouterr())

    return call

"""The hidden folder of unfinished work, in which a mosaic that was stopped can go on."""

import contextlib
import hashlib
import json
import os
import shutil
import uuid

import numpy as np

from demsmith.core.mosaic.schedulers import StopFile
from demsmith.core.raster.outputs import cannot_write

NAME = ".demsmith-mosaic"
_FINGERPRINT = "fingerprint.json"


class Workplace:
    """A folder of results, each whole or not there.

    Parameters
    ----------
    folder : str
        The mosaic's output folder; the workplace is inside.
    fingerprint : dict
        What the results depend on.

    Attributes
    ----------
    resumed : bool
        Whether there are results of an earlier run with the same fingerprint; others are thrown
        away.
    """

    def __init__(self, folder, fingerprint):
        self._folder = os.path.join(folder, NAME)
        self._fingerprint = fingerprint_of(fingerprint)
        self.resumed = self._begun() == self._fingerprint
        self.stop = StopFile(self.path("stop"))

    def open(self):
        """Make the folder, or take up the work that is in it.

        Raises
        ------
        OutputError
            If it cannot be made.
        """
        try:
            if not self.resumed:
                self.remove()
                os.makedirs(self._folder)
                self._write_fingerprint()
            with contextlib.suppress(FileNotFoundError):
                os.remove(self.path("stop"))
        except OSError as error:
            raise cannot_write(self._folder, error.strerror) from None

    def remove(self):
        """Throw all of it away."""
        shutil.rmtree(self._folder, ignore_errors=True)

    def path(self, name):
        """Give the path of a result."""
        return os.path.join(self._folder, name)

    def _begun(self):
        try:
            with open(self.path(_FINGERPRINT), encoding="utf-8") as file:
                return file.read()
        except (OSError, UnicodeDecodeError):
            return None

    def _write_fingerprint(self):
        with whole(self.path(_FINGERPRINT)) as unfinished:
            unfinished.write(self._fingerprint.encode())


def fingerprint_of(facts):
    """Give a text that changes with any of the facts.

    Examples
    --------
    >>> fingerprint_of({"size": 1}) == fingerprint_of({"size": 2})
    False
    """
    text = json.dumps(facts, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


@contextlib.contextmanager
def whole(path):
    """Yield a binary file that is at ``path`` when the context ends, and not before.

    Raises
    ------
    OutputError
        If it cannot be written to its end.
    """
    unfinished = f"{path}.{uuid.uuid4().hex}"
    try:
        with open(unfinished, "wb") as file:
            yield file
        os.replace(unfinished, path)
    except OSError as error:
        raise cannot_write(path, error.strerror) from None
    finally:
        with contextlib.suppress(OSError):
            os.remove(unfinished)


def save(path, **arrays):
    """Save arrays by their names."""
    with whole(path) as file:
        np.savez(file, **arrays)


def load(path, *names):
    """Give some of the arrays that were saved; all of them as a dict if none is named."""
    with np.load(path) as saved:
        if not names:
            return dict(saved)
        return [saved[name] for name in names]


def save_facts(path, facts):
    """Save a dict that JSON can hold."""
    with whole(path) as file:
        file.write(json.dumps(facts, allow_nan=False).encode())


def load_facts(path):
    """Give what `save_facts` saved."""
    with open(path, encoding="utf-8") as file:
        return json.load(file)

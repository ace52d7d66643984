"""Where an output may be written, and how it gets there whole or not at all."""

import contextlib
import os
import re
import shutil
import tempfile

from demsmith.core.errors import InputError, OutputError
from demsmith.core.raster.opening import files_of

_EXTENSIONS = (".tif", ".tiff")
# Files that GDAL reads along with a GeoTIFF; those of an overwritten one would speak of the old.
_SIDECARS = (".aux.xml", ".ovr", ".msk", ".msk.ovr")
_WORKSHOP = ".demsmith-"


def check_output(path, *, inputs=(), overwrite=False):
    """Refuse an output that cannot be written, before any work is done for it.

    Parameters
    ----------
    path : str or path-like
        Where a GeoTIFF is to be written.
    inputs : iterable of str or path-like
        Rasters that are read; neither they nor files they are made of may be overwritten.
    overwrite : bool
        Whether another existing file may be.

    Raises
    ------
    InputError
        If the name is no GeoTIFF's, or it is one of the inputs.
    OutputError
        If the folder is missing or not writable, or the file exists.
    """
    path = os.fspath(path)
    if not path.lower().endswith(_EXTENSIONS):
        raise InputError(f"output '{path}' must be a GeoTIFF: end its name in .tif")
    check_place(path, inputs=inputs, overwrite=overwrite)


def check_place(path, *, inputs=(), overwrite=False):
    """As `check_output`, for a file of any kind."""
    path = os.fspath(path)
    folder = os.path.dirname(os.path.abspath(path))
    if not os.path.exists(folder):
        raise OutputError(f"cannot write '{path}': there is no folder '{folder}'; make it first")
    if not os.path.isdir(folder):
        raise OutputError(f"cannot write '{path}': '{folder}' is a file, not a folder")
    if os.path.isdir(path):
        raise OutputError(f"cannot write '{path}': it is a folder; give a file's name")
    if os.path.lexists(path):
        _refuse_input(path, inputs)
        if not overwrite:
            raise OutputError(
                f"'{path}' exists already; give another name, or allow it to be overwritten "
                "(--overwrite)"
            )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"cannot write '{path}': folder '{folder}' is not writable")


def check_outputs(paths, *, inputs=(), overwrite=False):
    """As `check_output`, for the GeoTIFFs of one run: also, no two may be the same file.

    Parameters
    ----------
    paths : dict
        By name; None for an output that is not wanted.
    inputs, overwrite
        As in `check_output`.

    Returns
    -------
    dict
        The paths as text.

    Raises
    ------
    InputError, OutputError
        As `check_output` does.
    """
    paths = {name: os.fspath(path) if path else None for name, path in paths.items()}
    places = set()
    for path in filter(None, paths.values()):
        check_output(path, inputs=inputs, overwrite=overwrite)
        if os.path.realpath(path) in places:
            raise InputError(f"two outputs are '{path}'; give each a name of its own")
        places.add(os.path.realpath(path))
    return paths


def _refuse_input(path, inputs):
    if not os.path.exists(path):
        return
    for source in inputs:
        for name in files_of(os.fspath(source)):
            if os.path.samefile(path, name):
                raise InputError(
                    f"output '{path}' is an input (of '{source}'); give it another name"
                )


@contextlib.contextmanager
def whole_or_nothing(path):
    """Yield a path in a new folder beside ``path``; what is written there is then moved here.

    The file has its final base name already, so sidecars written with it come along under
    their right names. If the body raises, nothing is left behind, and what was at ``path``
    before is untouched.

    Raises
    ------
    OutputError
        If the folder cannot be written to.
    """
    folder, name = os.path.split(os.path.abspath(path))
    try:
        workshop = tempfile.mkdtemp(prefix=_WORKSHOP, dir=folder)
    except OSError as error:
        raise cannot_write(path, error.strerror) from None
    try:
        yield os.path.join(workshop, name)
        settle(workshop, [path])
    finally:
        shutil.rmtree(workshop, ignore_errors=True)


def settle(workshop, paths):
    """Move finished files, and what was written along with them, to where they belong.

    Parameters
    ----------
    workshop : str
        Folder on the same disk that holds them under their final base names.
    paths : list of str
        Where they belong, all in one folder.

    Raises
    ------
    OutputError
        If the folder cannot be written to.
    """
    folder = os.path.dirname(os.path.abspath(paths[0]))
    names = [os.path.basename(path) for path in paths]
    made = sorted(os.listdir(workshop), key=lambda other: other in names)  # the sidecars first
    try:
        for other in made:
            os.replace(os.path.join(workshop, other), os.path.join(folder, other))
        for sidecar in (name + suffix for name in names for suffix in _SIDECARS):
            if sidecar not in made:
                _remove(os.path.join(folder, sidecar))
    except OSError as error:
        raise cannot_write(paths[0], error.strerror) from None


@contextlib.contextmanager
def all_or_nothing(paths):
    """Yield a `whole_or_nothing` path for each output of several, none of which stays alone.

    Parameters
    ----------
    paths : dict
        Paths by name; ``None`` for an output that is not wanted, and then not yielded.
    """
    with contextlib.ExitStack() as outputs:
        yield {
            name: outputs.enter_context(whole_or_nothing(path))
            for name, path in paths.items()
            if path
        }


def cannot_write(path, reason):
    """Make the `OutputError` of a path, without the folders of unfinished work in it."""
    message = f"cannot write '{path}': {reason}"
    return OutputError(re.sub(re.escape(_WORKSHOP) + r"\w+[/\\]", "", message))


def _remove(path):
    with contextlib.suppress(FileNotFoundError):
        os.remove(path)

"""Elevation models inside zip archives: the one that is there is found by itself."""

import contextlib
import os
import zipfile
import zlib

from demsmith.core.errors import InputError
from demsmith.core.raster import hgt

_RASTER_EXTENSIONS = (
    ".hgt", ".tif", ".tiff", ".asc", ".dem", ".dt0", ".dt1", ".dt2", ".bil", ".flt", ".img",
    ".vrt", ".grd", ".nc",
)  # fmt: skip


def is_zip(path):
    """Whether a path is a zip archive on disk."""
    return path.lower().endswith(".zip") and os.path.isfile(path)


@contextlib.contextmanager
def openable(path):
    """Yield a name by which GDAL opens the one raster in the zip archive at ``path``.

    Raises
    ------
    InputError
        If the archive is damaged, or holds no raster or several.
    """
    member, data = _unpack(path)
    if data is None:
        yield f"/vsizip/{{{path}}}/{member}"
        return
    with hgt.in_memory(data, hgt.tile_name(member, path)) as memory:
        yield memory


def _unpack(path):
    """Find the archive's raster: its inner name, and its bytes if it is an .hgt tile."""
    try:
        with zipfile.ZipFile(path) as archive:
            member = _only_raster(archive, path)
            if not hgt.is_hgt(member.filename):
                return member.filename, None
            shown = f"{path}: {member.filename}"
            hgt.check_size(member.file_size, shown)
            if hgt.tile_name(member.filename, path) is None:
                raise InputError(hgt.nameless(shown))
            return member.filename, archive.read(member)
    except (zipfile.BadZipFile, zlib.error, EOFError) as error:
        raise InputError(
            f"'{path}' is truncated or damaged, or no zip archive ({error}); get it again"
        ) from None
    except (RuntimeError, NotImplementedError) as error:
        raise InputError(
            f"'{path}' cannot be unpacked ({error}); unpack it by other means"
        ) from None


def _only_raster(archive, path):
    members = [
        member
        for member in archive.infolist()
        if member.filename.lower().endswith(_RASTER_EXTENSIONS)
        and not os.path.basename(member.filename).startswith("._")  # macOS's shadow files
    ]
    tiles = [member for member in members if hgt.is_hgt(member.filename)]
    candidates = tiles or members
    if not candidates:
        raise InputError(f"'{path}' holds no raster that is known by its name; unpack it")
    if len(candidates) > 1:
        names = ", ".join(f"/vsizip/{path}/{member.filename}" for member in candidates[:5])
        more = ", ..." if len(candidates) > 5 else ""
        raise InputError(
            f"'{path}' holds {len(candidates)} rasters: give one of them: {names}{more}"
        )
    return candidates[0]

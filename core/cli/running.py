"""Finding the verb, running it, and turning what may happen into words and an exit status."""

import os
import sys
import traceback

from cyclopts import App, CycloptsError

import demsmith
from demsmith.core.cli import interruption
from demsmith.core.errors import Cancelled, DemsmithError

_VERBS = {
    "fill": "Fill the voids (holes without data) of an elevation raster.",
    "reconstruct": "Reconstruct the voids of SRTM and its like, with an error for every cell.",
    "mosaic": "Reconstruct a folder, list or VRT of tiles as one, seam-free.",
    "samples": "Make terrain from points, lines, contours, a sketch, or noise alone.",
    "solar": "Compute the sunlight on terrain, with its shadows.",
    "thin": "Keep only the cells that carry the shape, or a random share.",
    "drainage": "Tell how much ground drains through each cell, and find streams.",
    "relief": "Make slope, aspect, hillshade, mean deviation or topographic position.",
    "proceduralize": "Model terrain by noise functions, and evaluate it at any resolution.",
    "learn": "Learn a dictionary of terrain shapes from exemplars.",
    "compress": "Compress an elevation raster within a guaranteed error.",
    "decompress": "Decompress an .sct file, or any window of it, at any scale.",
    "info": "Tell what an .sct file holds, how small it is and how exact.",
    "validate": "Tell how wrong fills are, by artificial voids like the real ones.",
}


def make_app():
    """Make the Cyclopts app; a verb's module is imported when the verb is asked for."""
    app = App(
        name="demsmith",
        help="Mends, compresses and sharpens elevation models.",
        version=f"demsmith {demsmith.__version__}",
        help_format="plaintext",
        suppress_keyboard_interrupt=False,
        usage="Usage: demsmith VERB INPUT... OUTPUT [--option value]...",
    )
    app["--help"].group = app["--version"].group = "Options"
    for verb, help_text in _VERBS.items():
        app.command(f"demsmith.core.cli.{verb}:app", name=verb, help=help_text)
    return app


def run(argv=None):
    """Run a command line; returns the exit status."""
    try:
        make_app()(argv, exit_on_error=False, print_error=False, result_action="return_none")
        sys.stdout.flush()
    except (Cancelled, KeyboardInterrupt) as stop:
        _complain(str(stop) or str(Cancelled()))
        return interruption.exit_status()
    except CycloptsError as error:
        _complain(str(error))
        print(f"see {' '.join(['demsmith', *(error.command_chain or ())])} --help", file=sys.stderr)
        return 2
    except DemsmithError as error:
        _complain(str(error))
        return error.exit_status
    except BrokenPipeError:
        _let_go_of_output()
        return 1
    except OSError as error:
        where = f": '{error.filename}'" if error.filename else ""
        _complain(f"{error.strerror or error}{where}")
        _let_go_of_output()
        return 1
    except MemoryError as error:
        _complain(f"not enough memory. {error}".rstrip())
        return 1
    except Exception:
        traceback.print_exc()
        _complain("this is a fault of Demsmith; please report the lines above")
        return 1
    return 0


def _complain(message):
    print(f"error: {message}", file=sys.stderr)


def _let_go_of_output():
    """If what was printed cannot be written, keep Python from trying it again on exit."""
    try:
        sys.stdout.flush()
    except OSError:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115, till the end

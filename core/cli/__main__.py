"""``python -m demsmith.core.cli`` is the same as ``demsmith``."""

import sys

from demsmith.core.cli import program

if __name__ == "__main__":
    sys.exit(program())

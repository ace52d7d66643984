"""``python -m demsmith.core.cli`` is the same as ``demsmith``."""

import sys

from demsmith.core.cli import main

if __name__ == "__main__":
    sys.exit(main())

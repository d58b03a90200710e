"""The command ``faircurve``."""

import signal
import sys

from . import _core


def main() -> int:
    """Runs the program with the arguments of this process."""
    # Ctrl-C ends it as it ends other programs: Python would only take note of it.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _core.run(sys.argv)


if __name__ == "__main__":
    sys.exit(main())

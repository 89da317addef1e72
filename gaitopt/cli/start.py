"""Where ``gaitopt`` begins: Ctrl-C is looked after before anything else is imported."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType


def main() -> None:
    """Run the command that ``sys.argv`` names, and exit."""
    # There is nothing to clear up before the modules below are there.
    signal.signal(signal.SIGINT, _stop_at_once)
    from gaitopt.cli.interrupts import end_stopped, stop_on_signals, was_stopped

    try:
        stop_on_signals()
        from gaitopt.cli.app import main as run

        run()
    except Exception:
        if not was_stopped():
            raise
        sys.exit(end_stopped())
    except KeyboardInterrupt:
        sys.exit(end_stopped())


def _stop_at_once(number: int, frame: FrameType | None) -> None:
    os.write(2, b"gaitopt: stopped\n")
    os._exit(130)

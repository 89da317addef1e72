"""Where ``gaitopt`` begins: Ctrl-C is looked after before anything else is imported."""

from __future__ import annotations

import sys

from gaitopt.cli.interrupts import end_stopped, stop_on_signals, was_stopped


def main() -> None:
    """Run the command that ``sys.argv`` names, and exit."""
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

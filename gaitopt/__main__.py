"""The command line: ``python -m gaitopt`` is ``gaitopt``."""

from gaitopt.cli.app import main

if __name__ == "__main__":
    main()

"""The command line: ``python -m gaitopt`` is ``gaitopt``."""

from gaitopt.cli.start import main

if __name__ == "__main__":
    main()

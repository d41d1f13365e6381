"""``python -m mapfilter``: the command line."""

from mapfilter.cli import main

if __name__ == "__main__":
    main()

"""``mapfilter`` and ``python -m mapfilter``: the command line.

Each process beside a command imports its main module again, so this one imports nothing by itself.
"""


def main() -> None:
    """Run the command line; a user's error gives one message and exit code 2."""
    from mapfilter.cli import main as command_line

    command_line()


if __name__ == "__main__":
    main()

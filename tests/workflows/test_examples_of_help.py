"""Examples of the help go on from one another."""

from command_line import mapfilter


def example(command):
    told = mapfilter(command, "--help").out.partition("Example:")[2]
    return next(line.split() for line in told.splitlines() if line.strip())


def test_pages_and_films_are_made_of_what_the_example_of_replay_writes():
    """They named a folder within it, in which there is nothing."""
    replay = example("replay")
    assert "--html" in replay
    folder = replay[replay.index("--out") + 1]
    assert example("film")[2] == example("view")[2] == folder

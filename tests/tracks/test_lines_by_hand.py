"""Lines of tables whose last fields are absent, by hand."""

import pytest

from mapfilter.tracks.readers.texts.lines import _padded


@pytest.mark.parametrize(
    ("block", "padded"),
    [
        (b"1,2,3,4\n5,6,7,8\n", b"1,2,3,4\n5,6,7,8\n"),
        (b"1,2\n5,6,7\n8,,,\n", b"1,2,,\n5,6,7,\n8,,,\n"),
        # Too few fields, too many, and none at all stay as they are; the last line has no end.
        (b"1\n1,2,3,4,5\n\n6,7", b"1\n1,2,3,4,5\n\n6,7,,"),
    ],
)
def test_absent_last_fields_of_four_become_empty_where_two_are_there(block, padded):
    assert _padded(block, 4, ",", 2) == padded

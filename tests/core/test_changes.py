"""Copies of frozen values in which some fields are changed."""

from dataclasses import dataclass, fields, replace
from functools import cached_property

import pytest

from mapfilter._changes import changed
from mapfilter._same import same
from mapfilter.positioning.bayes.state import BayesState


@dataclass(frozen=True)
class _Walk:
    length_m: float
    steps: int = 1

    @cached_property
    def step_m(self) -> float:
        return self.length_m / self.steps


def test_a_copy_is_what_dataclasses_make_and_leaves_the_other_as_it_was():
    before = BayesState(takeovers=2, area="a")
    after = changed(before, takeovers=3, proven=True)
    assert type(after) is BayesState
    assert same(after, replace(before, takeovers=3, proven=True))
    assert [getattr(before, name) for name in ("takeovers", "proven", "area")] == [2, False, "a"]
    assert list(vars(after)) == [one.name for one in fields(BayesState)]


def test_what_was_computed_of_other_fields_is_computed_anew():
    before = _Walk(6.0, 2)
    assert before.step_m == 3.0
    assert changed(before, steps=3).step_m == 2.0


def test_a_name_that_is_no_field_is_refused():
    with pytest.raises(TypeError, match="step_m"):
        changed(_Walk(6.0), step_m=2.0)

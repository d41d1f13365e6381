"""Generators of what lies beside the main belief, and filters that are made again."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mapfilter.positioning.bayes.maker import Maker
from mapfilter.positioning.bayes.rivals.own_draws import OwnDraws, Purpose, own_rng


@pytest.mark.parametrize(
    ("time_s", "milliseconds"),
    [(0.0, 0), (12.3456, 12346), (-12.3456, 12346), (5e6, 5_000_000_000 - 4_294_967_296)],
)
@pytest.mark.parametrize("purpose", Purpose)
def test_draws_are_those_of_a_purpose_at_a_time(purpose, time_s, milliseconds):
    expected = np.random.default_rng((int(purpose), milliseconds)).random(3)
    assert own_rng(time_s, purpose).random(3).tolist() == expected.tolist()


def test_purposes_keep_their_numbers():
    """Else the same log would be located otherwise by another release."""
    assert [int(one) for one in Purpose] == [1, 2, 3, 4, 5, 6, 7, 8, 9]


@pytest.mark.parametrize(
    ("name", "purpose"),
    [("forking", 1), ("moving", 2), ("carrying", 4), ("beginning", 5), ("unaided", 7)],
)
def test_each_motion_has_draws_of_its_own(name, purpose):
    draws = OwnDraws(9.25)
    found = getattr(draws, name)
    assert found.random() == np.random.default_rng((purpose, 9250)).random()
    # It goes on where it was.
    assert getattr(draws, name) is found


@dataclass(frozen=True)
class Made:
    model: str
    carriageways: str
    maker: str
    rules: str
    sources: tuple[str, ...] = ("usual",)


def test_a_filter_made_again_keeps_what_was_replaced_in_it():
    maker = Maker("a", lambda by: Made(f"model {by}", f"lanes {by}", f"maker {by}", f"rules {by}"))
    bound = replace(maker.make("a"), sources=("own",), model="another", maker="another")
    again = Made("model b", "lanes b", "maker b", "rules b", ("own",))
    assert maker.remade(bound, "b") == again
    kept = replace(bound, rules="own rules")
    assert maker.remade(kept, "b") == replace(again, rules="own rules")

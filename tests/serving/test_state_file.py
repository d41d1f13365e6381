"""Saved states come back to the bit, and damaged or foreign files are refused."""

import hashlib
import json
import pickle
from dataclasses import replace
from typing import get_args, get_type_hints

import numpy as np
import pytest
from asking import documents
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.errors import StoreError
from mapfilter.filters.grid import GridBelief
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.integrity import RadialTail
from mapfilter.positioning.merging import epochs
from mapfilter.serving import state_file, state_values
from mapfilter.serving.state_file import decode, encode

NOT_OF_PARTICLES = {GridBelief, RadialTail}
"""The other belief of a state, and the protocol of all tails."""


@pytest.fixture(scope="module")
def states(positioner):
    """States of a walk, and of one whose alternative has started."""
    rng, found, state = np.random.default_rng(0), [], positioner.begin()
    for epoch in epochs(documents()[1]):
        state, _ = positioner.step(state, epoch, rng)
        found.append(state)
    return found[::40]


def test_states_come_back_to_the_bit_with_the_same_objects_shared(states):
    for state in states:
        again = decode(encode({"state": state}), "made")["state"]
        assert (again.belief is None) == (state.belief is None)
        for name in ("state", "log_weight", "kept") if state.belief is not None else ():
            one, other = getattr(again.belief, name), getattr(state.belief, name)
            assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes())
        assert repr(again.watch) == repr(state.watch)
        assert encode({"state": again}) == encode({"state": state})
        if state.reported is not None and state.reported.belief is state.belief:
            assert again.reported.belief is again.belief


def test_a_summary_that_does_not_follow_from_particles_comes_back(states):
    """After particles were drawn anew it is that of those before, by which the next epoch goes."""
    belief = replace(states[-1].belief)
    vars(belief)["summary"] = belief.summary._replace(mass_50m=0.125)
    again = decode(encode({"belief": belief}), "made")["belief"]
    assert repr(again.summary) == repr(belief.summary)
    fresh = replace(belief)
    assert "summary" not in vars(decode(encode({"belief": fresh}), "made")["belief"])


def classes_in(hint):
    """The classes that a type hint names, in whatever union or tuple."""
    parts = get_args(hint)
    if parts:
        return set().union(*map(classes_in, parts))
    return {hint} if isinstance(hint, type) and hint.__module__.startswith("mapfilter") else set()


@pytest.mark.parametrize("name", state_values._CLASSES)
def test_whatever_a_saved_class_holds_can_be_saved(name):
    saved = {*state_values._CLASSES.values(), *state_values._ENUMS.values()}
    for hint in get_type_hints(state_values._CLASSES[name]).values():
        assert classes_in(hint) - saved <= NOT_OF_PARTICLES


def test_a_state_with_a_fix_comes_back(positioner):
    epoch = next(one for one in epochs(documents()[1]) if one.radio)
    west_m, south_m = positioner.area.origin_m
    given_fix = replace(epoch, gnss=GnssFix(west_m + 50.0, south_m + 50.0, 9.0, 9.0, 0.0))
    state, _ = positioner.step(positioner.begin(), given_fix, np.random.default_rng(0))
    again = decode(encode({"state": state}), "made")["state"]
    assert again.last_fix == state.last_fix == given_fix.gnss
    assert repr(again.watch.repeats) == repr(state.watch.repeats)


@settings(max_examples=40)
@given(
    st.recursive(
        st.none()
        | st.booleans()
        | st.integers()
        | st.floats()
        | st.text(st.characters(codec="utf-8")),
        lambda inner: (
            st.lists(inner, max_size=3).map(tuple)
            | st.dictionaries(st.text(max_size=3), inner, max_size=3)
        ),
        max_leaves=8,
    )
)
def test_plain_values_come_back(value):
    found = decode(encode({"value": value}), "made")["value"]
    assert repr(found) == repr(value)


@pytest.mark.parametrize("at", [0, 5, 40, 90, 200, 1000, -9000, -1])
def test_any_changed_byte_is_noticed(states, at):
    data = bytearray(encode({"state": states[1]}))
    data[at] ^= 1
    with pytest.raises(StoreError):
        decode(bytes(data), "made")


def test_cut_files_and_other_files_are_refused(states):
    data = encode({"state": states[1]})
    for size in (0, 1, 100, len(data) // 2, len(data) - 1):
        with pytest.raises(StoreError):
            decode(data[:size], "made")
    for other in (b"\n", b"[]\n", b"{}\n", b"null\n{}", pickle.dumps(1), b"[" * 5000):
        with pytest.raises(StoreError):
            decode(other, "made")
    written = f'"version": {state_file.VERSION}'.encode()
    for version, hint in ((1, "older mapfilter"), (state_file.VERSION + 1, "newer mapfilter")):
        other = data.replace(written, f'"version": {version}'.encode(), 1)
        with pytest.raises(StoreError, match=hint):
            decode(other, "made")


def forged(document, arrays=b""):
    """A file with a right checksum, as one who can write there makes it."""
    rest = json.dumps(document).encode()
    head = {"format": "mapfilter session", "version": state_file.VERSION}
    head["document_bytes"] = len(rest)
    head["sha256"] = hashlib.sha256(rest + arrays).hexdigest()
    return json.dumps(head).encode() + b"\n" + rest + arrays


@pytest.mark.parametrize(
    "document",
    [
        {"new": 0, "class": "Popen", "fields": {}},
        {"new": 0, "class": "BayesState", "fields": {"belief": None}},
        {"new": 0, "mapping": {"a": {"enum": "Status", "value": "HERE"}}},
        {"new": 0, "mapping": {"a": {"same": 7}}},
        {"new": 0, "mapping": {"a": {"new": 1, "array": {"dtype": "|O8", "shape": [1], "at": 0}}}},
        {"new": 0, "mapping": {"a": {"new": 1, "array": {"dtype": "<f8", "shape": [9], "at": 0}}}},
        {"new": 0, "mapping": {"a": {"new": 1, "array": {"dtype": "<f8", "shape": [-1], "at": 0}}}},
        {"new": 0, "mapping": {"a": {"new": 1, "array": {"dtype": "<f8", "shape": [1], "at": -8}}}},
        {"new": 0, "tuple": []},
        [1],
        7,
    ],
)
def test_forged_files_make_nothing_but_listed_values(document):
    with pytest.raises(StoreError):
        decode(forged(document, b"\0" * 16), "made")


def test_what_is_not_listed_cannot_be_saved():
    for value in (object(), [1], {1: 2}, np.array(["a"]), lambda: None):
        with pytest.raises(TypeError):
            encode({"value": value})

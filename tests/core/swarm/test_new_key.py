"""A new key is one line: its refusal, its page and its default follow."""

import pytest
from flockwire_core.swarm.outline import Outline
from flockwire_core.swarm.tables import Control, Positive, key
from flockwire_core.swarm.validation import validate


class Wider(Control):
    """A table with a key more."""

    fuel: Positive = key(2.5, "what a drone takes along", "s", le=60)


def test_a_new_key_is_described_and_refused_by_its_line():
    outline = Outline(Wider)
    (found,) = (one for one in outline.entries() if one.name == "fuel")
    assert (found.default, found.unit, found.meaning) == ("`2.5`", "s", "what a drone takes along")
    assert outline.takes(found.part) == "a number above 0 and of 60 or less"
    assert validate(Wider, {"fuel": 3.0}, "wider.toml", ValueError).fuel == 3.0
    for table, line in (
        ({"fuel": 61}, "fuel = 61: must be a number above 0 and of 60 or less, in s"),
        ({"fule": 3.0}, "fule = 3.0: unknown key; did you mean fuel?"),
    ):
        with pytest.raises(ValueError, match="wider") as refused:
            validate(Wider, table, "wider.toml", ValueError)
        assert str(refused.value) == f"wider.toml: {line}"

"""The first of lab/bench/order_sequences.py: orders from two terminals and a page, the last one to come down holds."""

from __future__ import annotations

import pytest
from order_sequences import fly

LOST = (100046,)  # a landing and a hold ended no start that was under way


@pytest.mark.parametrize("seed", [*LOST, *range(3)])
def test_the_last_hold_or_landing_of_a_sequence_holds(seed: int) -> None:
    found = fly(seed)
    assert found.wrong == "", str(found.sequence)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3, 100))
def test_more_sequences(seed: int) -> None:
    found = fly(seed)
    assert found.wrong == "", str(found.sequence)

"""What flights cost stays within the budget: whoever raises a limit says why in lab/bench/budget.toml."""

import sys

import pytest
from budget import budgets, counted

IN_FLIGHT = {"system calls of an agent in flight, a second"}  # counted by lab/bench/budget.py --flight alone

pytestmark = pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="the budget is of Python 3.11")


def test_each_figure_is_within_its_budget():
    found, limits = counted(), budgets()
    above = {name: figure for name, figure in found.items() if figure > limits[name].most}
    assert not above, f"above lab/bench/budget.toml: {above}"


def test_each_limit_has_a_reason_and_is_compared():
    found = {name: budget.reason for name, budget in budgets().items()}
    assert all(len(reason.split()) > 5 for reason in found.values())
    assert set(found) > IN_FLIGHT

"""Accelerations reach an airframe with lag as they are wanted."""

from math import exp

import pytest
from flockwire_core.pilot.law_command import AccelerationInput

PERIOD = 0.01  # s


def flown(lag, wanted, sent_of=lambda command: command):
    """Fly a first-order airframe of lag `lag` for a second; returns its velocity along x."""
    given, v, sent = AccelerationInput(lag, PERIOD), 0.0, (0.0, 0.0, 0.0)
    for k in range(100):
        given.follow(sent, PERIOD if k else 0.0)
        sent = sent_of(given.velocity((wanted, 0.0, 0.0)))
        v = sent[0] + (v - sent[0]) * (exp(-PERIOD / lag) if lag else 0.0)
    return v


@pytest.mark.parametrize("lag", [0.0, 0.02, 0.1, 0.3])
def test_the_airframe_accelerates_as_wanted_whatever_its_lag(lag):
    assert flown(lag, 0.5) == pytest.approx(0.5, abs=1e-9)


def test_where_a_filter_limits_the_command_it_goes_on_from_what_the_body_reached():
    slow = lambda command: (min(command[0], 0.2), 0.0, 0.0)  # noqa: E731
    assert flown(0.1, 0.5, slow) == pytest.approx(0.2, abs=0.02)

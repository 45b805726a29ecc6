"""Unix time that a step of the wall clock does not move."""

import json
import subprocess
import sys

import pytest
from flockwire_core import clock
from flockwire_core.clock import EPOCH, FIRST_SETTING, SteadyClock, epoch_environment
from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.session import Session


class Machine:
    """A wall clock and a monotonic clock."""

    def __init__(self):
        self.wall, self.monotonic = 1_700_000_000 * SECOND, 50 * SECOND

    def steady(self, epoch=None):
        return SteadyClock(lambda: self.wall, lambda: self.monotonic, epoch)

    def wait(self, seconds):
        self.wall, self.monotonic = self.wall + seconds * SECOND, self.monotonic + seconds * SECOND


@pytest.fixture
def machine():
    return Machine()


@pytest.mark.parametrize("step", [-(10**17), -FIRST_SETTING, -5 * SECOND, -1, 1, 5 * SECOND, FIRST_SETTING - 1])
def test_a_step_of_the_wall_clock_makes_nothing_older_or_younger(machine, step):
    steady = machine.steady()
    received = steady.now()
    machine.wall += step
    machine.wait(2)
    assert steady.now() - received == 2 * SECOND


@pytest.mark.parametrize("step", [FIRST_SETTING, 10**17])
def test_a_clock_that_is_set_for_the_first_time_is_followed(machine, step):
    steady = machine.steady()
    machine.wall += step
    assert steady.now() == machine.wall
    machine.wait(3)
    assert steady.now() == machine.wall


@pytest.mark.parametrize("step", [-(10**17), FIRST_SETTING, 10**17])
def test_once_messages_are_stamped_no_step_is_followed_nor_by_who_shares_a_time(machine, step):
    steady = machine.steady()
    machine.wall += 10**17  # its first setting
    stamped = steady.now()
    steady.settled = True
    machine.wall += step
    machine.wait(2)
    begun_again = machine.steady(steady.epoch)
    assert steady.now() == begun_again.now() == stamped + 2 * SECOND


@pytest.mark.sources  # replaces compiled functions
def test_a_session_settles_the_time(make_plan, machine, monkeypatch):
    monkeypatch.setattr(clock, "_STEADY", machine.steady())
    with Session(make_plan({"network.security": "none"}), "operator"):
        before = clock.now()
        machine.wall += 10**17
        assert clock.now() == before


def test_a_process_started_after_a_step_has_the_time_of_those_before_it(machine):
    first = machine.steady()
    machine.wall -= 5 * SECOND
    assert machine.steady(first.epoch).now() == first.now() == machine.steady().now() + 5 * SECOND


def test_a_child_is_given_the_time_of_its_parent():
    ask = "import json; from flockwire_core import clock; print(json.dumps([clock.epoch_environment(), clock.now()]))"
    shifted = {EPOCH: str(int(epoch_environment()[EPOCH]) + 5 * SECOND)}
    for given, ahead in ((epoch_environment(), 0), (shifted, 5), ({EPOCH: "junk"}, 0)):
        done = subprocess.run([sys.executable, "-c", ask], env=given, capture_output=True, check=True, timeout=30)
        epoch, now = json.loads(done.stdout)
        assert given[EPOCH] == "junk" or epoch == given
        assert abs(now - clock.now() - ahead * SECOND) < SECOND

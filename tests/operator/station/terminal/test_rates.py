import pytest
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.wire.status import Report, Status
from flockwire_operator.station.terminal.table import Rates

BEGAN = 1_790_000_000 * SECOND


def status(seconds, steps, identity="uav1"):
    stamp = BEGAN + nanoseconds(seconds)
    return Status(stamp, "world", identity, Report("hold"), steps, 0, 0, 0, 0, 0.0, 0, (), ())


def told(*statuses):
    """Return the rate after the last of `statuses`, (seconds, steps) each."""
    rates = Rates()
    return [rates.rate(status(*each)) for each in statuses][-1]


def test_the_first_status_gives_no_rate():
    assert told((0.0, 500)) == -1.0


def test_the_rate_is_that_of_the_last_half_second_or_more():
    assert told((0.0, 0), (0.5, 50)) == pytest.approx(100.0)
    assert told((0.0, 0), (0.5, 50), (1.0, 75)) == pytest.approx(50.0)


def test_in_between_the_last_rate_stays():
    assert told((0.0, 0), (0.5, 50), (0.6, 90), (0.9, 95)) == pytest.approx(100.0)


def test_a_frozen_one_has_no_rate():
    assert told((0.0, 0), (0.5, 50), (1.0, 50)) == 0.0


def test_a_process_that_restarted_counts_from_there():
    assert told((0.0, 1000), (0.5, 1050), (0.7, 10), (1.2, 60)) == pytest.approx(100.0)


def test_the_same_status_twice_changes_nothing():
    assert told((0.0, 0), (0.5, 50), (0.5, 50)) == pytest.approx(100.0)


def test_processes_are_counted_apart():
    rates = Rates()
    for seconds, steps in ((0.0, 0), (0.5, 50)):
        slow = rates.rate(status(seconds, steps // 10, "recorder"))
        fast = rates.rate(status(seconds, steps))
    assert (slow, fast) == (pytest.approx(10.0), pytest.approx(100.0))

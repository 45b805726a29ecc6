"""Flights in which a pilot did once what the protocol forbids, and those of the suite in virtual time, which do not."""

import pytest
from flockwire_analysis.collecting import Collector
from flockwire_analysis.conformance import deviations
from flockwire_analysis.reading import read_trace
from flockwire_analysis.summary import summarise
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import Key
from flockwire_core.wire.status import Report, Status
from recorded_flights import swarm_of

BEGIN = 1_790_000_000 * SECOND
TAKEOFF = Mission(BEGIN - SECOND, "world", "takeoff", giver=1, number=1)
START = Mission(BEGIN, "world", "start", BEGIN, giver=1, number=2)
HOLD = Mission(BEGIN + 1, "world", "hold", giver=2)
LAND = Mission(BEGIN + 2, "world", "land", giver=2)
AGAIN = Mission(BEGIN + 3, "world", "start", BEGIN, giver=1, number=3)
KNOWING = AGAIN._replace(number=4, downs=(HOLD.version, LAND.version))
FLYING, GROUNDED, STOPPED = FlightState.FLYING, FlightState.GROUNDED, FlightState.STOPPED


def replayed(*reports, steps=None, orders=()):
    """Return the deviations where the pilot of uav1 reports (phase, order, state, detail), ten times a second."""
    swarm = swarm_of()
    collector = Collector(swarm, {})
    for place, order in enumerate(orders):
        collector.add("mission", Key("mission", ""), order, place, order.stamp, BEGIN)
    for place, (phase, order, state, *detail) in enumerate(reports):
        stamp = BEGIN + place * SECOND // 10
        known = Telemetry(stamp, "world", state, 1.0, 0.0, 0.0)
        collector.add("telemetry", Key("telemetry", "uav1"), known, place, stamp, stamp)
        unnumbered = (order.version,) if order is not None and not order.number else ()
        report = Report(phase, *detail, telemetry_age=0.0, mission=order, unnumbered=unnumbered)
        count = steps[place] if steps is not None else 10 * place
        status = Status(stamp, "world", "uav1", report, count, 0, 0, 0, 0, 0.0, 0, (), ())
        collector.add("status", Key("status", "uav1"), status, place, stamp, stamp)
    return deviations(collector.trace(None))


def test_a_flight_that_conforms():
    flight = [("grounded", None, GROUNDED, "waits"), ("ready", None, GROUNDED), ("take-off", TAKEOFF, FLYING)]
    flight += [("hold", TAKEOFF, FLYING), ("formation", START, FLYING), ("hold", START, FLYING, "own pose is stale")]
    flight += [
        ("formation", START, FLYING),
        ("hold", HOLD, FLYING),
        ("landing", LAND, FLYING),
        ("ready", LAND, GROUNDED),
    ]
    assert replayed(*flight, ("take-off", KNOWING, GROUNDED)) == ()


@pytest.mark.parametrize(("before", "after"), [
    (("landing", LAND, FLYING), ("hold", LAND, FLYING)),  # a landing taken back
    (("landing", LAND, FLYING), ("take-off", LAND, FLYING)),
    (("formation", START, FLYING), ("formation", LAND, FLYING)),  # an order that is not obeyed
    (("formation", START, FLYING), ("formation", HOLD, FLYING)),
    (("hold", START, FLYING), ("hold", START, FLYING)),  # no reason why it is not in formation
    (("formation", START, FLYING), ("landing", START, FLYING)),  # no reason why it lands
    (("ready", HOLD, GROUNDED), ("take-off", HOLD, GROUNDED)),  # nobody takes off by a hold
    (("ready", None, GROUNDED), ("take-off", None, GROUNDED)),
    (("ready", None, GROUNDED), ("formation", START, GROUNDED)),  # from the ground
    (("formation", START, FLYING), ("ready", START, FLYING)),  # in the air
    (("grounded", None, GROUNDED), ("grounded", None, GROUNDED)),  # no reason why it is not ready
    (("formation", START, FLYING), ("stopped", START, FLYING)),  # nobody stopped it
    (("stopped", START, STOPPED), ("ready", START, GROUNDED)),
    (("landing", LAND, FLYING), ("formation", AGAIN, FLYING)),  # by an order that does not know the landing
    (("ready", LAND, GROUNDED), ("take-off", AGAIN, GROUNDED)),
    (("landing", LAND, FLYING), ("landing", HOLD, FLYING)),  # a hold takes no landing back
    (("hold", HOLD, FLYING), ("hold", None, FLYING)),
])  # fmt: skip
def test_one_change_that_the_protocol_forbids(before, after):
    first = ("hold", TAKEOFF, FLYING) if before[0] in ("hold", "formation", "landing") else ("ready", None, GROUNDED)
    assert replayed(before) == ()
    assert replayed(first, before, after), "is allowed"


def test_an_order_that_was_replaced_before_any_status_showed_it_held_all_the_same():
    """The second station's landing came 6 ms after the take-off."""
    flight = [("ready", None, GROUNDED), ("landing", LAND, GROUNDED)]
    assert replayed(*flight)
    assert replayed(*flight, orders=(TAKEOFF._replace(stamp=LAND.stamp - 1), LAND)) == ()


def test_a_process_that_was_restarted_begins_again_but_obeys_no_order_from_before():
    flight = [("formation", START, FLYING), ("hold", None, FLYING)]
    assert replayed(*flight, steps=(50, 1)) == ()
    assert replayed(*flight, steps=(50, 60))
    landed = [("ready", None, GROUNDED), ("ready", None, GROUNDED), ("take-off", TAKEOFF, GROUNDED)]
    (sentence,) = replayed(*landed, steps=(50, 1, 10))
    assert sentence == "uav1 at t = 0.2 s: take-off after ready (no order, takeoff)"


def test_a_deviation_fails_the_flight(good_flight):
    trace = read_trace(good_flight)
    assert all(check.ok for check in summarise(trace).checks)
    history = trace.histories["uav2"]
    at = next(place for place, one in enumerate(history) if one.phase == "landing")
    trace.histories["uav2"] = (*history[: at + 1], history[at]._replace(phase="formation"), *history[at + 1 :])
    (failure,) = summarise(trace).failures()
    assert failure.startswith("conformance: 1 (uav2 at ")
    assert failure.endswith(" s: formation after landing (land, land)), must be none")


def test_a_clock_that_is_set_back_says_nothing_about_the_airframe():
    """Stamps of telemetry are the driver's: those that fit to the pilot's new clock came while it was on the ground."""
    collector = Collector(swarm_of(), {})
    for place in range(60):
        stamp = BEGIN + place * SECOND // 10
        known = Telemetry(stamp, "world", GROUNDED if place < 20 else FLYING, 1.0, 0.0, 0.0)
        collector.add("telemetry", Key("telemetry", "uav1"), known, place, stamp, stamp)
        own = stamp if place < 50 else stamp - 4 * SECOND
        phase, order = ("ready", None) if place < 20 else ("take-off", TAKEOFF) if place < 30 else ("formation", START)
        if place == 29:
            phase = "hold"
        report = Report(phase, telemetry_age=0.0, mission=order)
        status = Status(own, "world", "uav1", report, 10 * place, 0, 0, 0, 0, 0.0, 0, (), ())
        collector.add("status", Key("status", "uav1"), status, place, own, stamp)
    assert deviations(collector.trace(None)) == ()


def test_an_order_that_came_before_a_clock_was_set_back_was_not_from_the_future():
    collector = Collector(swarm_of(), {})
    for place, (own, phase, order) in enumerate([(0, "ready", None), (-5, "take-off", TAKEOFF)]):
        stamp = BEGIN + place * SECOND // 10
        known = Telemetry(stamp, "world", FLYING if place else GROUNDED, 1.0, 0.0, 0.0)
        collector.add("telemetry", Key("telemetry", "uav1"), known, place, stamp, stamp)
        report = Report(phase, telemetry_age=0.0, mission=order)
        status = Status(stamp + own * SECOND, "world", "uav1", report, 10 * place, 0, 0, 0, 0, 0.0, 0, (), ())
        collector.add("status", Key("status", "uav1"), status, place, status.stamp, stamp)
    assert deviations(collector.trace(None)) == ()


def test_a_recording_that_begins_between_two_statuses_says_nothing_about_the_airframe_before():
    collector = Collector(swarm_of(), {})
    for place, (phase, order) in enumerate([("ready", None), ("take-off", TAKEOFF)]):
        stamp = BEGIN + place * SECOND // 10
        if place:
            known = Telemetry(stamp, "world", FLYING, 1.0, 0.0, 0.0)
            collector.add("telemetry", Key("telemetry", "uav1"), known, place, stamp, stamp)
        report = Report(phase, telemetry_age=0.0, mission=order)
        status = Status(stamp, "world", "uav1", report, 10 * place, 0, 0, 0, 0, 0.0, 0, (), ())
        collector.add("status", Key("status", "uav1"), status, place, stamp, stamp)
    assert deviations(collector.trace(None)) == ()

"""The verdict on flights that went wrong, each in one way; all but one check must pass them."""

import inspect
import json
import re

import flockwire_analysis.checks
import pytest
from flockwire_analysis import outcomes
from flockwire_analysis.reading import read_trace
from flockwire_analysis.report import write_files
from flockwire_analysis.summary import summarise
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import SwarmFileError
from flockwire_core.swarm.tables import BOUNDED, Checks
from flockwire_core.wire.keys import MISSION, Key
from recorded_flights import collect, swarm_of

BOUNDS = Checks()
T0 = 1_790_000_000 * SECOND  # mission time 0


@pytest.fixture
def failures():
    """Fly with the given numbers; returns the sentence of each failed check, by its name."""

    def of(**numbers):
        summary = summarise(collect(**{"begin": -2.0, "end": 7.0} | numbers))
        return {check.name: check.sentence() for check in summary.checks if not check.ok}

    return of


def test_a_good_flight_passes(failures):
    assert failures() == {}


def test_an_estimate_that_is_15_m_off(failures):
    found = failures(estimate_bias=15.0)
    assert list(found) == ["observation tail"]
    assert found["observation tail"].startswith("observation tail: 15")
    assert found["observation tail"].endswith("m, must be at most 0.1 m in the last 30 % of each phase")


@pytest.mark.long
@pytest.mark.parametrize("nowhere", [{"place_bias": 1e253}, {"leaps_at": 2.0}])
def test_a_drone_that_is_nowhere_in_this_world_fails_the_flight_and_not_the_report(tmp_path, nowhere):
    trace = collect(begin=-2.0, end=4.0, **nowhere)
    summary = summarise(trace)
    write_files(trace, summary, tmp_path / "out")
    assert (tmp_path / "out/report.html").exists()
    assert not summary.ok
    assert json.loads(json.dumps(summary.as_json(), allow_nan=False))


def test_followers_that_leave_their_places_after_they_had_settled(good_flight):
    trace = read_trace(good_flight)
    for number in trace.swarm.followers:
        positions = trace.positions(number)
        late = positions.stamps > trace.missions[-1].stamp - SECOND
        positions.values[late, 0] += 2.0
    found = {check.name: check for check in summarise(trace).checks}
    assert found["formation settled"].ok
    assert not found["formation tail"].ok
    assert found["formation tail"].value == pytest.approx(2.0, abs=0.01)


def moved(trace, number, begin, end, along_x):
    """Put a drone `along_x` m aside from `begin` to `end`, s of mission time; returns the failed checks."""
    positions = trace.positions(number)
    times = (positions.stamps - T0) / SECOND
    positions.values[(times >= begin) & (times < end), 0] += along_x
    return {check.name: check.sentence() for check in summarise(trace).checks if not check.ok}


def test_a_follower_off_its_place_between_settling_and_the_tail(swarm_of):
    trace = collect(begin=-2.0, end=20.0, swarm=swarm_of(False, limits={"speed": 90.0}))
    assert moved(trace, 3, 5.0, 9.9, 0.3) == {}  # in time
    found = moved(trace, 3, 5.0, 11.0, 0.3)
    assert list(found) == ["formation kept"]
    assert found["formation kept"].startswith(
        "formation kept: 5.99 s, must be at most 5 s more than 0.1 m off its place"
    )


def test_a_formation_that_never_settled_is_not_judged_twice():
    assert "formation kept" not in {check.name for check in summarise(collect(end=8.0, place_bias=0.2)).checks}


@pytest.mark.parametrize("polygon", [False, True])
@pytest.mark.parametrize(("outside", "ok"), [(0.05, True), (0.3, False)])
def test_a_drone_outside_the_fence(swarm_of, polygon, outside, ok):
    east = 6.0
    table = {"min": [-8.0, -8.0, -0.5], "max": [8.0, 8.0, 3.0]}
    table |= (
        {"polygon": [[-7.0, -7.0], [east, -7.0], [east, 7.0], [-7.0, 7.0]]} if polygon else {"max": [east, 8.0, 3.0]}
    )
    trace = collect(
        begin=-2.0, end=10.0, swarm=swarm_of(limits={"fence": table, "speed": 1e4}, checks={"off_place": 9.0})
    )
    positions = trace.positions(2)
    times = (positions.stamps - T0) / SECOND
    positions.values[(times > 4.0) & (times < 5.0), 0] = east + outside
    checks = {check.name: check for check in summarise(trace).checks}
    assert checks["fence"].value == pytest.approx(outside)
    assert checks["fence"].ok is ok


def test_what_stands_outside_the_fence_is_not_a_flight(swarm_of):
    """Carry a drone away once it is down."""
    trace = collect(begin=-2.0, end=10.0)
    trace.positions(2).values[-40:, 0] += 100.0
    assert {check.name: check for check in summarise(trace).checks}["fence"].ok


def test_a_formation_that_settles_too_late(failures, swarm_of):
    late = failures(decay=2.0, swarm=swarm_of(checks={"settle_within": 2.0, "formation_tail": 1.0}))
    assert list(late) == ["formation settled"]
    assert "must be at most 2 s after the start of each" in late["formation settled"]


def test_a_drone_that_crashes_and_says_it_is_ready(failures):
    found = failures(crash_at=5.0)
    assert set(found) == {"speed", "formation tail", "lost drones"}  # it falls
    assert "the motors of uav2 stopped without an order at t = 5.0 s" in found["lost drones"]


def test_a_drone_on_the_ground_while_its_pilot_says_formation(failures):
    found = failures(sits_at=4.0)
    assert found["on the ground in formation"] == ("on the ground in formation: 1 (uav3 from t = 5.4 s), must be none")
    assert "lost drones" not in found


def test_a_pilot_that_falls_silent(failures):
    found = failures(end=10.0, pilot_ends_at=4.0)
    assert list(found) == ["lost drones"]
    assert "the status of uav4 ends 8.1 s before the flight" in found["lost drones"]


def test_a_flight_that_does_not_land(failures):
    found = failures(lands=False)
    assert list(found) == ["landed"]
    assert found["landed"] == "landed: the recording ends without an order to land, 5 drones in the air"


def test_a_drone_that_stays_in_the_air():
    trace = collect(begin=-2.0, end=6.0)
    trace.of("telemetry", 2).values[-1] = (1.0, 0.9, 0.4, 0.0)
    trace.histories["uav2"] = trace.histories["uav2"][:-1]  # its pilot had not heard of it
    (failure,) = summarise(trace).failures()
    assert failure == "landed: uav2 was not on the ground at the end, but 0.40 m above it"


def test_a_drone_that_lands_elsewhere(failures):
    assert failures(drifts=0.5) == {"landed": "landed: 1 m (uav1), must be at most 0.5 m from where the landing began"}


def test_an_emergency_stop_is_named_and_the_fall_is_not_too_fast(failures):
    found = failures(stops_at=9.0, end=9.0)
    assert list(found) == ["emergency stop"]
    assert found["emergency stop"] == "emergency stop: 1 (the operator's order), must be none"


def test_a_recorder_that_was_frozen_is_not_a_slow_agent(failures):
    found = failures(end=10.0, unrecorded=(5.0, 7.5))
    assert list(found) == ["recording", "lost messages"]
    assert found["recording"].startswith("recording: 2.6")
    assert "must be at most 0.5 s without recorded messages" in found["recording"]


def test_an_insiders_forged_times_and_counts_are_in_no_figure():
    honest = summarise(collect(begin=-2.0, end=10.0))
    forged = ((0, 2**31), (2**62, 2**32 - 1), (T0 - 3600 * SECOND, 2**30), (T0 + 10**17, 151), (2**62, 0))
    found = summarise(collect(begin=-2.0, end=10.0, forged=forged))
    assert found.failures() == ()
    assert found.messages.lost == 0
    assert found.messages.recorded == honest.messages.recorded + len(forged)
    assert found.rate == pytest.approx(honest.rate, abs=0.01)
    for hop, figures in found.latency_ms.items():
        assert (figures.p50, figures.p99) == pytest.approx(
            (honest.latency_ms[hop].p50, honest.latency_ms[hop].p99), abs=0.01
        )
    assert {name: value for name, value in found.as_json().items() if name.endswith("_s")} == {
        name: value for name, value in honest.as_json().items() if name.endswith("_s")
    }


def test_a_recording_that_ends_in_flight(failures):
    assert list(failures(unrecorded=(8.0, 99.0))) == ["landed"]


def test_each_order_is_judged_by_itself(swarm_of):
    trace = collect(begin=-2.0, end=16.0, second_start=8.0, swarm=swarm_of(formations={"row": {"kind": "line"}}))
    summary = summarise(trace)
    first, second = summary.phases
    assert (first.formation, first.begin_s, first.length_s) == ("", 0.0, 8.0)
    assert (second.formation, second.begin_s, second.length_s) == ("row", 8.5, 7.5)
    assert first.formation_error_m.max_tail < 0.1
    assert second.formation_error_m.max_tail > 1.0
    assert summary.formation_error_m.max_tail == second.formation_error_m.max_tail
    failed = [check.sentence() for check in summary.checks if not check.ok]
    assert "(formation 'row', from 8.5 s on, 7.5 s long)" in failed[0]


def test_a_good_order_is_not_affected_by_one_that_was_taken_back_at_once(swarm_of):
    trace = collect(begin=-2.0, end=10.0, second_start=8.5, swarm=swarm_of(formations={"row": {"kind": "line"}}))
    summary = summarise(trace)
    assert [phase.length_s for phase in summary.phases] == [8.5, 1.0]
    assert summary.ok


def test_an_order_to_hold_that_is_taken_back_before_the_landing_changes_nothing():
    """Hold for 0.7 s, fly the formation for 2.3 s with the drones off their places, land."""
    trace = collect(begin=-2.0, end=10.0, holds_at=7.0, resumes_at=7.7)
    for number in trace.swarm.followers:
        positions = trace.positions(number)
        positions.values[positions.stamps > trace.missions[-3].stamp, 0] += 0.4
    summary = summarise(trace)
    assert [phase.length_s for phase in summary.phases] == [7.0, pytest.approx(2.3)]
    assert summary.phases[1].formation_error_m.settled_s is None
    assert {check.name: check.ok for check in summary.checks}["formation settled"]


def test_formations_that_were_all_taken_back_at_once_are_judged_anyway(failures):
    assert "formation settled" in failures(end=1.5)


def test_a_repetition_of_an_order_that_was_not_received_is_not_a_lost_message(failures):
    assert failures(orders_lost=2) == {}


def test_an_order_that_was_obeyed_and_not_recorded_is_lost(failures):
    unrecorded = Mission(T0 + 10 * SECOND + 5, "world", "land")
    assert failures(obeyed=unrecorded) == {"lost messages": "lost messages: 1, must be none"}


def test_what_never_took_off_is_not_said_to_be_in_the_air():
    silent = frozenset({MISSION, *(Key("telemetry", f"uav{i}") for i in range(5))})
    landed = next(check for check in summarise(collect(end=-1.0, silent=silent)).checks if check.name == "landed")
    assert landed.sentence().startswith("landed: no telemetry of uav0 was recorded; no telemetry of uav1 was recorded;")


def test_drones_without_telemetry_are_not_said_to_be_in_the_air(failures):
    found = failures(lands=False, silent=frozenset(Key("telemetry", f"uav{i}") for i in (1, 2)))
    assert found["landed"] == (
        "landed: the recording ends without an order to land, 3 drones in the air; no telemetry of uav1 was recorded; "
        "no telemetry of uav2 was recorded"
    )


def test_a_follower_may_leave_its_place_for_an_obstacle(swarm_of):
    near = {"avoidance": {"obstacle_influence_radius": 1.2}, "limits": {"speed": 4.0}}
    trace = collect(begin=-2.0, end=40.0, deflection=0.6, swarm=swarm_of(**near))
    summary = summarise(trace)
    assert summary.formation_error_m.max_tail > 0.1 > summary.phases[0].judged_tail_m
    assert summary.failures() == ()


def test_a_place_that_cannot_be_had_counts_as_no_error(swarm_of):
    """All followers are 0.3 m off; an obstacle has their places from 15 s on the average, all from 18.5 s on."""
    obstacle = {"center": [4.0, 4.0, 0.0], "radius": 3.2}
    formation = {"kind": "circle", "radius": 0.5, "rate": 1.0}
    summary = summarise(collect(place_bias=0.3, swarm=swarm_of(formation=formation, obstacles=[obstacle])))
    assert summary.formation_error_m.max_tail > 0.29
    assert not {"formation settled", "formation tail"} & {check.name for check in summary.checks if not check.ok}
    (phase,) = summary.phases
    assert phase.without_place_s == pytest.approx({f"uav{i}": 25.0 for i in range(1, 5)}, abs=1.0)


def test_the_default_bounds():
    assert (BOUNDS.formation_tail, BOUNDS.observation_tail, BOUNDS.settle_within) == (0.1, 0.1, 20.0)


@pytest.mark.parametrize(("ends_at", "lost"), [(10.5, True), (11.7, False)])
def test_a_pilot_that_ends_once_all_are_down_is_not_lost(failures, monkeypatch, ends_at, lost):
    monkeypatch.setattr(outcomes, "SILENCE", SECOND // 10)
    assert ("lost drones" in failures(end=10.0, pilot_ends_at=ends_at)) is lost


SWITCHES = {"formation_settled": False, "observation_tail": False, "separation": True}


def test_a_check_that_is_switched_off_is_shown_and_fails_nothing(fly):
    flown = fly(begin=-2.0, end=10.0, estimate_bias=15.0, swarm=swarm_of(checks=SWITCHES))
    summary = summarise(read_trace(flown))
    found = {check.name: check for check in summary.checks}
    tail = found["observation tail"]
    assert (tail.ok, tail.judged, summary.ok) == (True, False, True)
    assert tail.value == pytest.approx(15.0, abs=0.1)
    assert tail.sentence().endswith("not judged ([checks] of the swarm file)")
    assert [check.name for check in summary.checks if not check.judged] == ["formation settled", "observation tail"]
    assert "judged" not in found["separation"].as_json()
    assert tail.as_json()["judged"] is False


def test_every_check_can_be_switched_off_by_its_name(good_flight):
    trace = read_trace(good_flight)
    keys = {name: False for name in Checks.model_fields if Checks.model_fields[name].annotation is bool}
    keys |= dict.fromkeys(BOUNDED, False)
    off = Checks(**keys).off
    sources = "".join(inspect.getsource(module) for module in (flockwire_analysis.checks,))
    assert off == set(re.findall(r'(?:_none|_at_least|_at_most|Check)\(\s*"([a-z ]+)"', sources))
    assert {check.name for check in summarise(trace).checks} <= off
    assert Checks.model_validate_json(Checks(**keys).model_dump_json()).off == off


def test_an_unknown_check_is_refused_with_the_nearest_name(make_swarm):
    with pytest.raises(SwarmFileError, match=r"formation_setled = false: unknown key; did you mean checks\.form"):
        make_swarm({"checks": {"formation_setled": False}})
    with pytest.raises(SwarmFileError, match=r"checks\.settle_within = false: must be a number above 0"):
        make_swarm({"checks": {"settle_within": False}})


def test_a_value_just_beyond_its_limit_is_not_rounded_to_it():
    check = flockwire_analysis.checks.Check("separation", 0.399996, 0.4, False, "at least 0.4 m", "m")
    assert check.sentence() == "separation: 0.399996 m, must be at least 0.4 m"
    assert flockwire_analysis.checks.Check("speed", 3.0, 3.0, True, "", "m/s").found() == "3 m/s"

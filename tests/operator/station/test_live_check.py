"""The pre-flight check of a swarm that runs: each thing that may be wrong is a line with a remedy."""

import pytest
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import add
from flockwire_core.wire.status import Reason, Report, Status
from flockwire_operator.station.live_check import WAITING, Seen, findings, table

NOW = 1_790_000_000 * SECOND
TELLOS = {"drones.1.airframe": "tello", "drones.2.airframe": "tello"}


def status(identity, phase="ready", detail="", bound=0.001, **report):
    known = Report(phase, detail, pose_age=0.01, **report)
    return Status(NOW, "world", identity, known, 0, 0, 0, 0, 0, 0.0, 0, (), (), 0.0, bound)


def tello(serial, *more):
    """Return the reasons of a driver of a Tello."""
    return (Reason("firmware", "SDK 20"), Reason("serial", serial), *more)


@pytest.fixture
def plan(make_plan):
    return make_plan(TELLOS)


@pytest.fixture
def well(plan):
    """Return a swarm that is ready, as the operator sees it."""
    statuses = {identity: status(identity) for identity in plan.started}
    for k in (1, 2):
        statuses[f"driver{k}"] = status(f"driver{k}", "grounded", reasons=tello(f"SERIAL{k}"))
    telemetry = {i: Telemetry(NOW, "world", FlightState.GROUNDED, 0.9, 0.0, -1.0) for i in plan.pilots}
    starts = {i: plan.swarm.drone(i).start for i in plan.pilots}
    return Seen(statuses, telemetry, {i: [start, add(start, (0.001, 0.0, 0.0))] for i, start in starts.items()}, NOW)


def failed(plan, seen):
    return [(line.subject, line.item, line.remedy) for line in findings(plan, seen) if line.remedy]


def test_a_swarm_that_is_ready_has_no_remedy(plan, well):
    lines = list(table(findings(plan, well)))
    assert all(line.startswith("  ok") for line in lines)
    assert [line.split()[2:] for line in lines if line.startswith("  ok   uav1 ")][-6:-2] == [
        ["link", "nothing", "wrong"], ["firmware", "SDK", "20"], ["serial", "SERIAL1"], ["IMU", "nothing", "wrong"],
    ]  # fmt: skip


def report(identity, *told, **more):
    """Return what lets a process report something else."""
    return lambda seen: seen.statuses.update({identity: status(identity, *told, **more)})


def flight(**changed):
    """Return what changes the telemetry of drone 3."""
    return lambda seen: seen.telemetry.update({3: seen.telemetry[3]._replace(**changed)})


def lose_pose(seen):
    seen.statuses["uav3"] = status("uav3")._replace(report=Report("grounded", "waits for its own pose"))


def stand_elsewhere(seen):
    seen.positions[3][:] = [(9.0, 0.0, 0.0)]


WRONG = [
    (stand_elsewhere, "uav3", "start", "limits.start_tolerance = 0.2 m"),
    (lambda seen: seen.statuses.pop("gateway"), "gateway", "process", "flockwire gateway SWARM"),
    (lambda seen: seen.statuses.pop("driver2"), "driver2", "process", "flockwire driver SWARM 2"),
    (report("uav3", bound=-1.0), "uav3", "clock", "wait"),
    (report("recorder", "waiting", "does not hear gateway"), "recorder", "process", WAITING),
    (report("gateway", "waiting", "no frames"), "gateway", "process", WAITING),
    (lose_pose, "uav3", "pose", "is the body 'uav3' in the cameras' view"),
    (lambda seen: seen.positions[3].append((0.3, 0.0, 0.0)), "uav3", "still", "confuses it with another body"),
    (report("uav3", "grounded", "waits for uav2's estimate"), "uav3", "neighbours", "see the lines"),
    (report("driver1", "connecting", reasons=(Reason("link", "no reply: 1; 2", "join"),)), "uav1", "link", "join"),
    (report("driver1", reasons=tello("A", Reason("IMU", "shows a tilt", "level it"))), "uav1", "IMU", "level it"),
    (report("driver1", reasons=(Reason("pose", "no pose", "look"),)), "uav1", "pose", "look"),
    (report("driver2", reasons=tello("SERIAL1")), "uav2", "address", "tello.address"),
    (flight(battery=0.1), "uav3", "battery", "charge it"),
    (flight(state=FlightState.FLYING), "uav3", "on the ground", "land it first"),
    (lambda seen: seen.telemetry.pop(3), "uav3", "telemetry", "driver"),
]


@pytest.mark.parametrize(("spoil", "subject", "item", "remedy"), WRONG, ids=[f"{w[1]} {w[2]}" for w in WRONG])
def test_what_is_wrong_is_a_line_with_a_remedy(plan, well, spoil, subject, item, remedy):
    spoil(well)
    assert [text for who, what, text in failed(plan, well) if (who, what) == (subject, item) and remedy in text]

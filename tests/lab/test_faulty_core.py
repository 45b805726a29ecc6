"""Cores wrapped by faults: what they receive and send, what they simulate, and that they know nothing of it."""

from __future__ import annotations

from collections.abc import Callable
from math import dist
from random import Random
from typing import Any, ClassVar, Literal, get_args

import pytest
from flockwire_core.domain.airframe import Command
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start, make_core
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import Process
from flockwire_lab.faults.faulty_core import faulty
from flockwire_lab.faults.file import notes, parse_faults
from flockwire_lab.faults.kinds import Fault, FaultKind, NoiseBurst, TrackerLoss
from flockwire_lab.faults.targets import AIRFRAMES, WRAPPED, targets

BEGAN = 1_790_000_000 * SECOND
FRAME = SECOND // 100
PLACE = (1.0, 2.0, 0.0)
LOSS = TrackerLoss(at=0.495, kind="tracker", drone=1, duration=0.2)
NOISE = NoiseBurst(at=0.495, kind="noise", noise=0.5, duration=0.2)
TAKEOFF = Mission(BEGAN, "world", "takeoff")


def wrapped(plan: Plan, identity: str, faults: Any, took_off: int | None = None) -> Any:
    return faulty(make_core(Start(plan, identity, BEGAN, Random(1))), faults, plan, identity, took_off)


def film(core: Any) -> list[tuple[float, float]]:
    """Return how far the cameras see drone 1 from its place, m, and when, s, in 100 frames."""
    seen = []
    for k in range(1, 101):
        now = BEGAN + k * FRAME
        core.receive(Key("truth", "uav1"), Pose(now, "world", PLACE), now)
        for frame in core.source.take(now):
            seen += [(k / 100, dist(body.position, PLACE)) for body in frame.bodies]
    return seen


@pytest.mark.parametrize("restarted", [False, True])
def test_faults_count_from_the_take_off_ordered_now_or_before_a_restart(
    make_plan: Callable[..., Plan], restarted: bool
) -> None:
    core = wrapped(make_plan(), "gateway", (LOSS,), BEGAN if restarted else None)
    if not restarted:
        core.receive(MISSION, TAKEOFF, BEGAN)
    assert {round(k / 100, 2) for k in range(1, 101)} - {t for t, _ in film(core)} == {k / 100 for k in range(50, 70)}


def test_noise_comes_and_goes(make_plan: Callable[..., Plan]) -> None:
    core = wrapped(make_plan(), "gateway", (NOISE,), BEGAN)
    assert {t for t, off in film(core) if off > 0.0} == {k / 100 for k in range(50, 70)}


def test_before_a_take_off_there_are_no_faults_and_other_orders_are_none(make_plan: Callable[..., Plan]) -> None:
    core = wrapped(make_plan(), "gateway", (LOSS,))
    core.receive(MISSION, Mission(BEGAN, "world", "start", BEGAN), BEGAN)
    assert len(film(core)) == 100


def test_a_later_take_off_does_not_have_the_faults_again(make_plan: Callable[..., Plan]) -> None:
    core = wrapped(make_plan(), "gateway", (LOSS,), BEGAN - 60 * SECOND)
    core.receive(MISSION, TAKEOFF, BEGAN)
    assert len(film(core)) == 100


def test_a_wind_within_another_gives_way_to_it_again(make_plan: Callable[..., Plan]) -> None:
    """From 2 s on it blows at 1 m/s, from 3 to 4 s at 2 m/s, from 7 s on no more."""
    plan = make_plan()
    winds = [
        {"kind": "wind", "at": at, "duration": duration, "velocity": [speed, 0.0, 0.0]}
        for at, duration, speed in ((2.0, 5.0, 1.0), (3.0, 1.0, 2.0))
    ]
    core = wrapped(plan, "kinematics", parse_faults({"faults": winds}, plan, "test"), BEGAN)
    places = [0.0]
    for k in range(1, 901):
        now = BEGAN + k * FRAME
        core.receive(Key("command", "uav1"), Command(now, "world", (0.0, 0.0, 0.7)), now)
        places.append(dict(core.step(now))[Key("truth", "uav1")].position[0])
    speeds = [2.0 * (places[k + 100] - places[k + 50]) for k in range(0, 900, 100)]
    assert speeds == pytest.approx([0.0, 0.0, 1.0, 2.0, 1.0, 1.0, 1.0, 0.0, 0.0], abs=0.05)


def test_a_wrapped_tracker_serves_a_visitor_that_it_announces(make_plan: Callable[..., Plan]) -> None:
    plan = make_plan({"gateway": {"source": "natnet", "twin": {}}})
    table = {"kind": "visitor", "at": 0.5, "duration": 1.0, "body": "Ada", "start": [0.0] * 3, "velocity": [1.0, 0, 0]}
    core = wrapped(plan, "tracker-sim", parse_faults({"faults": [table]}, plan, "test"))
    assert "Ada" in core.names.values()
    frames: list[Any] = []
    core.serve(frames.append)
    for k in range(200):
        now, height = BEGAN + k * FRAME, min(k, 1) * 1.0  # in the air after the first frame
        for drone in plan.swarm.tracked:
            core.receive(Key("truth", uav(drone)), Pose(now, "world", (0.0, 0.0, height)), now)
        assert core.due(Key("truth", "uav4"))
        core.step(now)
    seen = [k for k, frame in enumerate(frames) if any(one.name == "Ada" and one.tracked for one in frame.bodies)]
    assert (len(frames), seen[0], seen[-1]) == (200, 51, 150)


class Mute(FaultKind):
    """A simulated airframe publishes nothing."""

    cores: ClassVar[tuple[Process, ...]] = AIRFRAMES
    edits: ClassVar[tuple[str, ...]] = ("truth", "telemetry")
    kind: Literal["mute"]
    drone: int

    def named_drones(self) -> dict[str, int]:
        return {"drone": self.drone}

    def edit(self, message: Any, since: float, now: int) -> None:
        return None


def test_a_new_fault_is_one_class(make_plan: Callable[..., Plan]) -> None:
    mute: Any = Mute(at=1.0, kind="mute", drone=1)
    core = wrapped(make_plan(), "kinematics", (mute,), BEGAN)
    before, after = (dict(core.step(BEGAN + SECOND + late)) for late in (-1, 0))
    assert {key.owner for key in before} - {key.owner for key in after} == {"uav1"}
    assert notes((mute,)) == {"faults": '[[1.0, "mute uav1"]]'}


def test_a_core_without_faults_is_not_wrapped(make_plan: Callable[..., Plan]) -> None:
    plan = make_plan()
    for identity in (*plan.started, uav(2)):
        core = make_core(Start(plan, identity, BEGAN, Random(1))) if identity not in plan.recorders else None
        if core is not None:
            assert faulty(core, (), plan, identity, None) is core


def test_who_judges_a_flight_is_no_target(make_plan: Callable[..., Plan]) -> None:
    plan = make_plan()
    assert set(plan.identities) - set(targets(plan)) == {"recorder", "operator", "console"}


def test_faults_wrap_the_cores_that_get_the_file() -> None:
    assert {row for kind in get_args(Fault) for row in kind.cores} == set(WRAPPED)

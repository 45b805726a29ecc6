"""The margins of a flight against rtamt, which evaluates the same formulas of signal temporal logic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.loading import parse_swarm
from flockwire_core.wire.phase import Phase
from flockwire_lab.search.margin import BOUNDS, Flown, Margin, Reports, States, age, owed
from flockwire_lab.search.robustness import margins

rtamt = pytest.importorskip("rtamt")  # its parser needs a Python below 3.13
SWARM = parse_swarm(
    {
        "name": "two",
        "formation": {"kind": "line", "spacing": 1.0},
        "graph": {"edges": [[0, 1]]},
        "drones": [{"id": 0, "start": [0.0, 0.0, 0.0]}, {"id": 1, "start": [1.0, 0.0, 0.0]}],
        "obstacles": [{"center": [0.0, 2.0, 0.0], "radius": 0.2}],
        "limits": {"fence": {"min": [-3.0, -3.0, -0.5], "max": [3.0, 3.0, 2.0], "margin": 0.5}},
    },
    "two",
)
STEP = 0.1  # s
TIMES = np.arange(0.0, 20.0, STEP)
NAMES = ("uav0", "uav1")


def reported(phases: Sequence[Phase], pose_ages: np.ndarray | float = 0.0) -> Reports:
    """The reports of a pilot with a full battery, whose other inputs are fresh."""
    fresh = np.zeros(len(TIMES))
    return Reports(TIMES, tuple(phases), fresh + pose_ages, fresh, fresh, fresh + 1.0, TIMES[:1])


def smooth(seed: int) -> Flown:
    """A flight of two drones on smooth random paths, whose poses and commands have pauses."""
    chance = np.random.default_rng(seed)
    places, poses, commands = {}, {}, {}
    for name in NAMES:
        waves = [
            chance.uniform(0.5, 2.5) * np.sin(chance.uniform(0.2, 0.8) * TIMES + chance.uniform(0.0, 6.0))
            for _ in range(3)
        ]
        places[name] = np.stack([waves[0], waves[1], np.maximum(waves[2], 0.0)], axis=1)
        begin = chance.uniform(2.0, 16.0)
        poses[name] = TIMES[(begin > TIMES) | (begin + chance.uniform(0.0, 12.0) < TIMES)]
        commands[name] = TIMES
    flying = tuple(FlightState.FLYING for _ in TIMES)
    return Flown(
        SWARM, dict.fromkeys(NAMES, TIMES), places, poses, commands,
        dict.fromkeys(NAMES, reported([Phase.HOLD] * len(TIMES))),
        {name: States(TIMES, flying, np.zeros(len(TIMES), np.bool_), np.zeros(len(TIMES))) for name in NAMES},
        took_off=True, stopped=np.inf, refused=(), deviations=(), failure="", seconds=20.0, fails={}, world_ended=False,
        still=(), jumps=(), formed=(), tails={}, visited=False,
    )  # fmt: skip


def robustness(formula: str, **signals: np.ndarray) -> float:
    """The robustness of a formula at the first sample, by rtamt."""
    specification = rtamt.StlDiscreteTimeSpecification()
    for name in signals:
        specification.declare_var(name, "float")
    specification.spec = formula
    specification.parse()
    values = {name: signal.tolist() for name, signal in signals.items()}
    return specification.evaluate({"time": list(range(len(TIMES))), **values})[0][1]


@pytest.mark.parametrize("seed", range(6))
def test_margins_of_places_are_rtamts(seed: int) -> None:
    flown = smooth(seed)
    found, (a, b) = margins(flown), (flown.places[name] for name in NAMES)
    low = np.minimum(a[:, 2], b[:, 2])
    gap = np.where(low > BOUNDS.in_the_air, np.linalg.norm(a - b, axis=1), 1e3)
    distance = robustness("always(gap >= 0.2)", gap=gap)
    assert ("distance" in found) == (gap.min() < 1e3)
    assert gap.min() == 1e3 or found["distance"].value == pytest.approx(distance / 0.2)
    clearances, outside = [], []
    for place in (a, b):
        high = place[:, 2] > BOUNDS.in_the_air
        away = np.where(high, np.hypot(place[:, 0], place[:, 1] - 2.0) - 0.2, 1e3)
        clearances.append(robustness("always(away >= 0.1)", away=away) / 0.1)
        beyond = np.where(high, np.max(np.abs(place[:, :2]) - 3.0, axis=1), -1e3)
        beyond = np.maximum(beyond, np.where(high, place[:, 2] - 2.0, -1e3))
        outside.append(robustness("always(beyond <= 1.0)", beyond=np.maximum(beyond, 0.0)))
    assert found["clearance"].value == pytest.approx(min(clearances))
    assert found["fence"].value == pytest.approx(min(outside))


def test_who_is_silent_is_down_in_time_as_rtamt_has_it() -> None:
    assert {in_time(seed) for seed in range(12)} == {True, False}


def in_time(seed: int) -> bool:
    """Whether the property holds in a flight, once rtamt and the margin agree."""
    bounds = replace(BOUNDS, silence=1.0)
    flown = smooth(seed)
    reach = 1.0 + 2.0 / SWARM.limits.vertical_speed
    owing = []
    for name in NAMES:
        silent = age(TIMES, flown.poses[name]) - SWARM.limits.staleness.pose_land
        height = flown.places[name][:, 2] - BOUNDS.in_the_air
        steps = int(reach / STEP + 1e-9)
        serves = np.minimum(height, silent - 1e-9)  # down, or its pose is back
        rest = np.concatenate([serves, np.full(steps + 1, -1.0)])  # what is not over at the end is owed no longer
        specification = rtamt.StlDiscreteTimeSpecification()
        for signal in ("silent", "flies"):
            specification.declare_var(signal, "float")
        specification.spec = f"always((silent > 0.0) implies eventually[0:{steps}](flies <= 0.0))"
        specification.parse()
        padded = np.concatenate([silent, np.full(steps + 1, -1.0)])
        time = list(range(len(padded)))
        value = specification.evaluate({"time": time, "silent": padded.tolist(), "flies": rest.tolist()})[0][1]
        owing.append(value >= 0.0)
    assert (margins(flown, bounds)["silence"].value >= 0.0) == all(owing)
    return all(owing)


def test_the_age_of_what_is_owed_is_that_of_always_in_rtamt() -> None:
    pending = np.array([0, 1, 1, 1, 0, 1, 1, 0], np.bool_)
    times = np.arange(8) * 0.5
    assert owed(times, pending).tolist() == [0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.5, 0.0]
    assert owed(times, ~pending).tolist() == [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert owed(times, np.ones(8, np.bool_)).tolist() == times.tolist()


def flew(**changes: object) -> Flown:
    return replace(smooth(0), **changes)


def still_at(height: float, x: float = 0.0) -> np.ndarray:
    return np.tile([x, 0.0, height], (len(TIMES), 1))


def test_a_stop_is_owed_until_the_motors_are_off() -> None:
    obeyed = States(TIMES, (FlightState.FLYING,) * len(TIMES), TIMES > 5.45, np.zeros(len(TIMES)))
    late = replace(obeyed, stopped=TIMES > 7.05)
    flown = flew(stopped=5.0, states={"uav0": obeyed, "uav1": late})
    assert margins(flew(stopped=5.0, states={"uav0": obeyed}))["stop"].value == pytest.approx(0.6)
    assert margins(flown)["stop"].value == pytest.approx(-1.0)
    assert margins(flown)["stop"].who == "uav1"
    assert "stop" not in margins(flew())


def test_a_rung_is_owed_from_its_age_on() -> None:
    ages = np.where(TIMES > 5.0, TIMES - 5.0, 0.0)
    phases = tuple(Phase.FORMATION if t < 5.25 else Phase.HOLD for t in TIMES)
    reports = dict.fromkeys(NAMES, reported(phases, ages))
    found = margins(flew(reports=reports))["rung"]
    assert found.violated  # it holds for 15 s without a pose
    landing = tuple(phase if t < 6.05 else Phase.LANDING for phase, t in zip(phases, TIMES, strict=True))
    reports = {name: replace(report, phases=landing) for name, report in reports.items()}
    assert margins(flew(reports=reports))["rung"].value == pytest.approx(1.0 - 1.0 / 1.3)


def test_an_empty_battery_lands() -> None:
    phases = [Phase.FORMATION if t < 5.25 else Phase.LANDING for t in TIMES]
    empty = replace(reported(phases), batteries=np.where(TIMES < 5.0, 1.0, 0.05))
    flown = flew(places={"uav0": still_at(1.0), "uav1": still_at(1.0)}, reports={"uav1": empty})
    assert margins(flown)["rung"].value == pytest.approx(1.0 - 0.2 / 0.3)
    late = replace(empty, phases=(Phase.HOLD,) * len(TIMES))
    unknown = replace(late, batteries=np.where(TIMES < 5.0, 1.0, -1.0))
    assert margins(replace(flown, reports={"uav1": late}))["rung"].violated
    assert not margins(replace(flown, reports={"uav1": unknown}))["rung"].violated


def test_without_the_leaders_pose_a_follower_holds_and_lands() -> None:
    leads = TIMES[TIMES < 5.05]

    def margin(last: float, phase: Phase, owner: str = "uav1") -> Margin | None:
        phases = [phase if t < last else Phase.LANDING for t in TIMES]
        reports = {owner: reported(phases)}
        return margins(flew(poses={"uav0": leads}, reports=reports, states={})).get("rung")

    assert margin(6.05, Phase.FORMATION).value == pytest.approx(1.0 - 1.0 / 1.3)
    assert margin(6.65, Phase.FORMATION).what == "uav1 not at leader estimate: hold after 1.60 s"
    assert not margin(10.05, Phase.HOLD).violated
    assert margin(10.65, Phase.HOLD).violated
    assert not margin(10.65, Phase.HOLD, "uav0").violated
    late = replace(reported([Phase.HOLD if t < 10.65 else Phase.LANDING for t in TIMES]), begun=np.array([0.0, 7.0]))
    restarted = flew(poses={"uav0": leads}, reports={"uav1": late}, states={})
    assert not margins(restarted)["rung"].violated  # it counts from its own beginning


def test_a_landing_lasts_its_descent_and_what_it_may_wait() -> None:
    def landing(down: float) -> Margin:
        places = still_at(1.0)
        places[down < TIMES] = 0.0
        lands = reported([Phase.HOLD if t < 1.95 else Phase.LANDING for t in TIMES])
        return margins(flew(places={"uav0": places, "uav1": still_at(0.0)}, reports={"uav0": lands}))["landing"]

    bound = BOUNDS.landing + 2.0 / SWARM.limits.vertical_speed
    assert landing(5.05).value == pytest.approx(1.0 - 3.0 / bound)
    assert landing(5.05).what == "uav0 lands for 3.0 s"
    assert landing(19.0).violated


def test_what_the_protocol_forbids_is_a_violation() -> None:
    assert "protocol" not in margins(flew())
    forbidden = margins(flew(deviations=("uav1 at t = 2.0 s: take-off after landing (land, land)",)))
    assert forbidden["protocol"].violated
    assert forbidden["protocol"].who == "uav1"


def test_the_limit_of_a_driver_restarts_after_its_own_pause() -> None:
    ages = np.where(TIMES > 5.0, TIMES - 5.0, 0.0)

    def driven(kept: np.ndarray) -> float:
        flying = (FlightState.FLYING,) * int(kept.sum())
        states = States(TIMES[kept], flying, np.zeros(len(flying), np.bool_), ages[kept])
        return margins(flew(states={"uav0": states}, reports={}))["rung"].value

    assert driven(TIMES < 5.95) == pytest.approx(1.0 - 0.9 / 1.3)
    assert driven(TIMES < 6.95) == pytest.approx(1.0 - 1.9 / 1.3)
    assert driven((TIMES < 5.25) | ((TIMES > 9.05) & (TIMES < 9.95))) == pytest.approx(1.0 - 0.8 / 1.3)
    assert driven((TIMES < 5.25) | (TIMES > 9.05)) < -1.0
    ages[TIMES > 5.45] += 1.1  # its clock is set ahead, which it takes for a pause
    assert driven(TIMES < 5.95) == pytest.approx(1.0 - 0.4 / 1.3)
    assert driven(TIMES < 7.95) < -0.8


def test_the_end_the_contact_and_orders_have_margins() -> None:
    high = flew(places={"uav0": still_at(0.0), "uav1": still_at(1.5, x=2.0)})
    assert margins(high)["down"] == Margin(pytest.approx(-29.0), TIMES[-1], "uav1", "ended at 1.50 m")
    assert "down" not in margins(replace(high, world_ended=True))
    falls = still_at(0.0)
    falls[:100, 2] = 2.0 * (100 - np.arange(100)) * STEP
    fell = flew(places={"uav0": falls, "uav1": still_at(0.0)})
    assert margins(fell)["contact"].value == pytest.approx(-1.0)
    assert margins(replace(fell, jumps=(TIMES[98],)))["contact"].value == 1.0  # as fast as the clock was set ahead
    assert margins(flew(refused=((4.5, "uav1"),)))["order"].value == pytest.approx(-0.5)
    assert margins(flew(seconds=90.0))["over"].value == pytest.approx(-0.2)
    assert margins(flew(formed=((5.0, 20.0),)))["formation"].value == pytest.approx(0.75)
    assert margins(flew(tails={"uav1": (9.0, 0.15)}))["tail"].value == pytest.approx(-0.5)


def test_who_falls_is_not_judged_but_struck() -> None:
    near = flew(places={"uav0": still_at(1.0), "uav1": still_at(1.0, x=0.1)}, fails={"uav1": 0.0})
    assert "distance" not in margins(near)
    assert margins(replace(near, fails={}))["distance"].value == pytest.approx(-0.5)


def test_a_driver_that_is_frozen_owes_neither_fence_nor_clearance() -> None:
    away = still_at(1.0, x=-2.0)
    away[100:, :2] = (0.0, 6.0)  # through an obstacle, over the fence
    away[95:100, :2] = (0.0, 2.0)
    frozen = replace(smooth(0).states["uav0"], times=TIMES[:91])
    states = {
        "uav0": replace(frozen, states=frozen.states[:91], stopped=frozen.stopped[:91], command_ages=np.zeros(91))
    }
    places = {"uav0": away, "uav1": still_at(1.0)}
    driven = margins(flew(places=places))
    assert driven["fence"].violated
    assert driven["clearance"].violated
    owed_by_others = margins(flew(places=places, states=states))
    assert not owed_by_others["fence"].violated
    assert not owed_by_others["clearance"].violated


def test_who_is_outside_once_its_driver_is_awake_again_may_come_back() -> None:
    def margin(back: float, again: float = 99.0, still: tuple[tuple[float, float], ...] = ()) -> float:
        places = still_at(1.0)
        out = ((TIMES > 6.0) & (back > TIMES)) | (again < TIMES)
        places[out, 0] = 5.0
        awake = (TIMES < 5.0) | (TIMES > 9.0) if not still else TIMES >= 0.0
        driver = smooth(0).states["uav0"]
        states = replace(driver, times=TIMES[awake], states=driver.states[: awake.sum()],
                         stopped=driver.stopped[awake], command_ages=driver.command_ages[awake])  # fmt: skip
        flown = flew(places={"uav0": places, "uav1": still_at(0.0)}, states={"uav0": states}, still=still)
        return margins(flown)["fence"].value

    assert margin(10.0) == 1.0
    assert margin(10.0, again=12.0) == pytest.approx(-1.0)
    assert margin(10.0, still=((5.0, 9.0),)) == 1.0  # the world was frozen

"""A lie, a silence, a freeze, a restart, in rounds and by events: bounded, named, and nobody stays in the air."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import numpy as np
import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.law import Decision, Observation
from flockwire_core.loading import load_swarm, parse_swarm
from flockwire_core.swarm.model import uav
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.world import World
from flockwire_laws.aggregative import RESTARTED, Aggregative
from flockwire_laws.event_triggered import EventTriggered, Sent
from law_swarms import EXAMPLES, of_five

LONG = partial(pytest.param, marks=pytest.mark.long)
AT = 6.0  # s after the take-off order
CUT = {"kind": "cut", "from": "uav2", "to": "uav1", "duration": 3.0}
FREEZE = {"kind": "freeze", "process": "uav2", "duration": 0.6}
RESTART = {"kind": "restart", "process": "uav2"}
KILL = {"kind": "kill", "process": "uav2"}
FAR = (50.0, 0.0, 0.0)  # m


class Flown:
    """A flight of `swarm` under one fault; all of it landed, and no two came too near."""

    def __init__(self, swarm: Any, fault: dict[str, Any] | None = None) -> None:
        faults = parse_faults({"faults": [{"at": AT, **fault}] if fault else []}, Plan(swarm), "test")
        self.said: dict[str, list[str]] = {uav(i): [] for i in swarm.flying}
        self._rows: dict[str, list[tuple[float, ...]]] = {uav(i): [] for i in swarm.flying}
        self._off = 0
        World(swarm, 1, 14.0, faults, self._take).run()
        self.places = {name: np.array(rows) for name, rows in self._rows.items()}  # s, m
        stacked = np.array([one[:: len(one) // 500][:500, 1:] for one in self.places.values()])
        apart = np.linalg.norm(stacked[:, None] - stacked, axis=-1) + 9.0 * np.eye(len(stacked))[..., None]
        assert apart.min() > swarm.avoidance.drone_safety_distance - 0.02
        assert max(one[-1, 3] for one in self.places.values()) < 0.05

    def _take(self, published: Any) -> None:
        kind, owner = published.key
        if kind == "mission":
            self._off = self._off or published.at
        elif kind == "truth":
            t = (published.at - self._off) / SECOND if self._off else -1.0
            self._rows[owner].append((t, *published.message.position))
        elif kind == "status" and owner in self.said:
            self.said[owner].append(published.message.report.line)

    def has_said(self, pilot: str, text: str) -> bool:
        return any(text in line for line in self.said[pilot])

    def points(self, t: float) -> np.ndarray:
        """Return all places in the plane, `t` s after the take-off order, m."""
        return np.array([one[np.searchsorted(one[:, 0], t)][1:3] for one in self.places.values()])

    def centre(self, t: float) -> np.ndarray:
        return self.points(t).mean(axis=0)


def example(name: str) -> Any:
    return load_swarm(EXAMPLES / f"{name}.toml")


@pytest.mark.parametrize("fault", [CUT, LONG(FREEZE)])
def test_rounds_wait_for_a_silent_neighbour_and_end_at_the_same_minimum(fault: dict[str, Any]) -> None:
    cut, whole = Flown(example("aggregative"), fault), Flown(example("aggregative"))
    assert cut.has_said("uav1", "nothing from uav2")
    assert not cut.has_said("uav4", "nothing from")
    assert cut.centre(13.0) == pytest.approx(whole.centre(13.0), abs=1e-3)


def test_an_agent_that_restarts_in_rounds_is_named_and_all_land_where_they_were() -> None:
    flown = Flown(example("aggregative"), RESTART)
    for neighbour in ("uav1", "uav3"):
        assert flown.has_said(neighbour, RESTARTED.format(2))
    assert flown.centre(11.0) == pytest.approx(flown.centre(AT), abs=5e-3)


@pytest.mark.parametrize(("fault", "most"), [(CUT, 0.02), LONG(FREEZE, 0.02), LONG(RESTART, 0.02)])
def test_events_that_are_missed_move_the_average_by_little(fault: dict[str, Any], most: float) -> None:
    flown = Flown(example("event_triggered"), fault)
    after = flown.centre(13.0)
    assert np.linalg.norm(after - flown.centre(AT)) < most
    assert flown.has_said("uav1", "nothing from uav2")
    places = 1.2 * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    assert np.linalg.norm(flown.points(13.0) - places - after, axis=1).max() < 0.06  # the bound of the theorem


@pytest.mark.parametrize("name", [LONG("rigid"), LONG("aggregative"), "event_triggered"])
def test_all_land_when_a_neighbour_is_dead(name: str) -> None:
    flown = Flown(example(name), KILL)
    if name != "rigid":  # by sight it is still there
        assert flown.has_said("uav1", "nothing from uav2")


class Liar:
    """In front of a law: drone 2 sends what `lie` makes of its messages, after two seconds in formation."""

    def __init__(self, settings: Any) -> None:
        super().__init__(settings)  # type: ignore[call-arg]
        self._lies = settings.number == 2

    def step(self, observation: Observation) -> Decision:
        decision: Decision = super().step(observation)  # type: ignore[misc]
        lies = self._lies and observation.t >= 2.0
        return decision._replace(message=self.lie(decision.message)) if lies else decision


class LyingRounds(Liar, Aggregative):
    """Its mean is far away."""

    def lie(self, message: Any) -> Any:
        return message and message._replace(s=FAR)


class LyingEvents(Liar, EventTriggered):
    """It is far away, at each step."""

    def lie(self, message: Any) -> Any:
        return Sent(FAR)


@pytest.mark.sources
@pytest.mark.parametrize("law", ["LyingRounds", LONG("LyingEvents")])
def test_a_lie_moves_drones_no_further_than_filter_and_fence_allow(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lying_law", sys.modules[__name__])
    table = of_five("aggregative" if law == "LyingRounds" else "event_triggered")
    table["control"]["law"] = f"lying_law:{law}"
    table["limits"] = {"speed": 1.0, "fence": {"min": [-4.0, -4.0, -0.5], "max": [4.0, 4.0, 3.0]}}
    flown = Flown(parse_swarm(table, "test"))
    rows = np.concatenate([one[one[:, 0] > 0.0] for one in flown.places.values()])
    assert np.abs(rows[:, 1:3]).max() < 4.1
    assert np.abs(flown.points(13.0)).max() > 3.0  # it did move them

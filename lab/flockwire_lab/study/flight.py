"""One flight of a study, on any worker; the result does not depend on the machine."""

from __future__ import annotations

from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any, NamedTuple

from flockwire_analysis.checks import ABOUT_THE_RECORD
from flockwire_analysis.expenditure import costs
from flockwire_analysis.key_figures import Summary
from flockwire_analysis.summary import summarise
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import InputError

from flockwire_lab.coverage import events
from flockwire_lab.flight import Flight, fly_in_memory
from flockwire_lab.study.file import Study
from flockwire_lab.study.variation import Table, vary


class Quantity(NamedTuple):
    """A figure of every run: key, name, unit, where a summary has it, its limit in the swarm file, its bad end."""

    key: str
    text: str
    unit: str
    path: str
    limit_path: str = ""
    high_is_bad: bool = True

    def of(self, summary: Summary) -> float | None:
        """Return the figure of a run, None if it has none."""
        found: float | None = attrgetter(self.path)(summary)
        return found

    def limit(self, swarm: Swarm) -> float | None:
        """Return the limit, None without one."""
        return float(attrgetter(self.limit_path)(swarm)) if self.limit_path else None


QUANTITIES = (
    Quantity("min_distance_uav_m", "smallest distance between drones", "m",
             "min_distance_uav_m", "avoidance.drone_safety_distance", high_is_bad=False),
    Quantity("min_distance_obstacle_m", "smallest distance to an obstacle", "m",
             "min_distance_obstacle_m", "avoidance.obstacle_safety_distance", high_is_bad=False),
    Quantity("observation_tail_m", "observation error, largest in the tail", "m", "observation_error_m.max_tail"),
    Quantity("formation_tail_m", "formation error, largest in the tail", "m", "formation_error_m.max_tail"),
    Quantity("settled_s", "until the formation had settled", "s", "formation_error_m.settled_s"),
    Quantity("max_speed_m_s", "highest speed", "m/s", "max_speed_m_s", "limits.speed"),
)  # fmt: skip


class Task(NamedTuple):
    """Run `run` of a plan at the grid point number `point`; `table` is the study's swarm file."""

    plan: Study
    table: Table
    point: int
    run: int


@dataclass(frozen=True, slots=True)
class Result:
    """The result of a run: `figures` in m, s and m/s, None if there is none; `margin`: smallest distance / limit."""

    point: int
    run: int
    seed: int
    ok: bool
    failed: tuple[str, ...]  # names of the checks, or "flight"
    reason: str
    margin: float
    drawn: dict[str, Any]
    figures: dict[str, float | None]
    events: dict[str, int] = field(default_factory=dict)  # how often each happened (coverage.py)


def fly(task: Task) -> Result:
    """Fly one run to its end; it raises nothing: a run that cannot be flown has failed."""
    plan, seed = task.plan, task.plan.seed_of(task.run)
    drawn: dict[str, Any] = {}
    try:
        varied = vary(plan, task.table, plan.points[task.point], seed)
        drawn = varied.drawn
        flight = Flight(varied.swarm, seed, plan.duration, varied.faults)
        outcome, recorded = fly_in_memory(flight, lambda _: None)
        summary = summarise(recorded)
    except InputError as error:
        return Result(task.point, task.run, seed, False, ("refused",), str(error).replace("\n", "; "), 0.0, {}, {})
    except Exception as error:  # a user's law may raise anything; the study continues
        reason = f"{type(error).__name__}: {error}"
        return Result(task.point, task.run, seed, False, ("flight",), reason, 0.0, drawn, {})
    bad = {"flight": outcome.failure} if outcome.failure else {}
    judged = (check for check in summary.checks if check.name not in ABOUT_THE_RECORD)
    bad |= {check.name: check.sentence() for check in judged if not check.ok}
    return Result(
        task.point, task.run, seed, not bad, tuple(bad), "; ".join(bad.values()), _margin(varied.swarm, summary),
        drawn, {one.key: one.of(summary) for one in QUANTITIES} | costs(recorded),
        events(recorded),
    )  # fmt: skip


def _margin(swarm: Swarm, summary: Summary) -> float:
    """Return the smallest distance as a share of its limit, 0 if there is none."""
    distances = [one for one in QUANTITIES if not one.high_is_bad]
    kept = ((one.of(summary), one.limit(swarm)) for one in distances)
    return min((found / limit for found, limit in kept if found is not None and limit is not None), default=0.0)

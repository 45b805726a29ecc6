"""The figures and checks of a flight: the content of summary.json."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from flockwire_core.swarm.wording import beside

from flockwire_analysis.latency import Percentiles
from flockwire_analysis.tracking import ErrorFigures


@dataclass(frozen=True, slots=True)
class Check:
    """One check: `value` against `limit`, both in `unit`; `reason` is why there is no value, or its origin.

    One that the swarm file switched off is not `judged`; it is ok.
    """

    name: str
    value: float | None
    limit: float | None
    ok: bool
    rule: str  # in words
    unit: str = ""
    reason: str = ""
    judged: bool = True

    def as_json(self) -> dict[str, object]:
        """Return the entry of this check in summary.json."""
        entry: dict[str, object] = {"name": self.name, "value": self.value, "limit": self.limit, "ok": self.ok}
        return entry if self.judged else entry | {"judged": False}

    def found(self) -> str:
        """Return the result as text."""
        if self.value is None:
            return self.reason
        value = f"{self.value:.4g}"
        if not self.ok and self.limit is not None and float(value) == self.limit:
            value = beside(self.value, self.limit)
        value = f"{value} {self.unit}".strip()
        return f"{value} ({self.reason})" if self.reason else value

    def sentence(self) -> str:
        """Return the result and the rule as text."""
        found = f"{self.name}: {self.found()}"
        if not self.judged:
            return f"{found}, {self.rule}"
        return found + (f", must be {self.rule}" if self.value is not None else "")


@dataclass(frozen=True, slots=True)
class StepFigures:
    """Steps of all followers' agents: made, more than 1 and 5 ms after the pose was sent, and skipped."""

    made: int
    delayed_1ms: int
    delayed_5ms: int
    skipped: int


@dataclass(frozen=True, slots=True)
class Messages:
    """Messages recorded, lost before the recorder, and rejected by their receivers (by key and reason)."""

    recorded: int
    lost: int
    rejected: int
    rejected_by_key: dict[str, int]


@dataclass(frozen=True, slots=True)
class PhaseFigures:
    """One formation phase: the formation's name in the order, its begin, s from mission_start_ns, and its length, s.

    `judged_tail_m` is the largest formation error in the tail, except for detours around obstacles; `longest_off_s` the
    longest time, s, that a follower was off its place after all had settled, with the same exception. None if unknown.
    `without_place_s` is how long each follower had a place that cannot be had; this counts as no error.
    """

    formation: str
    begin_s: float
    length_s: float
    observation_error_m: ErrorFigures
    formation_error_m: ErrorFigures
    judged_tail_m: float | None
    longest_off_s: float | None
    without_place_s: dict[str, float]


FILTER_JUDGED = 0.05  # share of changed commands above which a flight shows the safety filter


@dataclass(frozen=True, slots=True)
class Summary:
    """The content of summary.json; lengths in m, speeds in m/s, None if unknown.

    The errors are those of the worst formation phase. `rate` is each agent's share of the due steps in all phases;
    `tracker` counts the gateway's bad frames; `left_out` are the drones that stayed on the ground by order; `missing`
    has a sentence for all missing data; `filtered` is the largest share of a drone's steps in formation in which the
    safety filter changed its law's command, but for `conflicts`: the share in which a law of ours and another drone, or
    a person, wanted the same space.
    """

    duration_s: float
    mission_start_ns: int | None
    drones: int
    left_out: tuple[str, ...]
    observation_error_m: ErrorFigures
    formation_error_m: ErrorFigures
    min_distance_uav_m: float | None
    min_distance_obstacle_m: float | None
    max_speed_m_s: float | None
    max_outside_m: float | None
    latency_ms: dict[str, Percentiles]
    steps: StepFigures
    messages: Messages
    tracker: dict[str, int]
    rate: dict[str, float | None]
    filtered: float | None
    conflicts: float | None
    missing: tuple[str, ...]
    phases: tuple[PhaseFigures, ...]
    checks: tuple[Check, ...] = ()

    @property
    def judged(self) -> tuple[PhaseFigures, ...]:
        """The phases in which followers can settle; all if none is long enough."""
        return long_enough(self.phases)

    @property
    def filter(self) -> str:
        """What the safety filter did to the law, empty if that is not known."""
        if self.filtered is None:
            return ""
        warning = f", above {FILTER_JUDGED:.0%}: this flight judges the filter, not the law"
        share = f"changed {self.filtered:.1%} of the law's commands in formation"
        share += f", {self.conflicts:.1%} more for drones and people" if self.conflicts else ""
        return share + (warning if self.filtered > FILTER_JUDGED else "")

    @property
    def ok(self) -> bool:
        """Whether all checks passed."""
        return all(check.ok for check in self.checks)

    def failures(self) -> tuple[str, ...]:
        """Return a sentence for each failed check."""
        return tuple(check.sentence() for check in self.checks if not check.ok)

    def as_json(self) -> dict[str, object]:
        """Return the content of summary.json."""
        lists = {"missing": list(self.missing), "phases": [asdict(phase) for phase in self.phases]}
        return asdict(self) | lists | {"checks": [check.as_json() for check in self.checks]}


def long_enough(phases: tuple[PhaseFigures, ...]) -> tuple[PhaseFigures, ...]:
    """Return the phases in which followers can settle; all if none is long enough."""
    shortest = 5.0  # s, in which followers can settle for 2 s
    return tuple(phase for phase in phases if phase.length_s >= shortest) or phases

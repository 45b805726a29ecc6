"""The figures and the verdict of a flight, computed from its trace."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass

from flockwire.swarm.model import uav

from flockwire_recorder import separation, tracking
from flockwire_recorder.checks import Check, Measured, checks
from flockwire_recorder.latency import HOPS, Percentiles, latencies, percentiles
from flockwire_recorder.phases import Span, airborne, formation_of, formation_phase
from flockwire_recorder.reading import Trace
from flockwire_recorder.tracking import ErrorFigures


@dataclass(frozen=True, slots=True)
class Deadlines:
    """Steps of all followers' agents: made, late by more than 1 and 5 ms, and skipped."""

    ticks: int
    late_1ms: int
    late_5ms: int
    skipped: int


@dataclass(frozen=True, slots=True)
class Messages:
    """Messages recorded, lost on the way to the recorder, and rejected by their receivers (by key and reason)."""

    recorded: int
    lost: int
    rejected: int
    rejected_by_key: dict[str, int]


@dataclass(frozen=True, slots=True)
class Summary:
    """What summary.json holds; lengths in m, speeds in m/s, None for what cannot be known.

    `rate` is each agent's share of the steps that the control rate asks for in the formation phase; `missing` has a
    sentence for whatever the trace lacks.
    """

    duration_s: float
    mission_start_ns: int | None
    drones: int
    observation_error_m: ErrorFigures
    formation_error_m: ErrorFigures
    min_distance_uav_m: float | None
    min_distance_obstacle_m: float | None
    max_speed_m_s: float | None
    latency_ms: dict[str, Percentiles]
    deadlines: Deadlines
    messages: Messages
    rate: dict[str, float | None]
    missing: tuple[str, ...]
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether all checks passed."""
        return all(check.ok for check in self.checks)

    def failures(self) -> tuple[str, ...]:
        """Return a sentence for each failed check."""
        return tuple(check.sentence() for check in self.checks if not check.ok)

    def as_json(self) -> dict[str, object]:
        """Return the content of summary.json."""
        return asdict(self) | {"missing": list(self.missing), "checks": [check.as_json() for check in self.checks]}


def summarise(trace: Trace) -> Summary:
    """Compute all figures of a flight; what cannot be computed is None, said in `missing`, and fails its check."""
    phase, flight = formation_phase(trace), airborne(trace)
    observation = formation = ErrorFigures()
    if phase is not None:
        observation = tracking.figures(tracking.observation_errors(trace), phase)
        formation = tracking.figures(tracking.formation_errors(trace), phase)
    gaps = _Gaps(trace, phase)
    nearest = nearest_obstacle = speed = None
    if not gaps.placeless:
        times = separation.common_times(flight)
        nearest = separation.smallest(list(separation.pair_distances(trace, times).values()))
        speed = separation.max_speed(trace, flight)
        if trace.swarm.obstacles:
            nearest_obstacle = separation.smallest(list(separation.obstacle_distances(trace, times).values()))
    rate = {trace.plan.pilot[number]: _rate(trace, number, phase) for number in trace.swarm.followers}
    measured = Measured(nearest, nearest_obstacle, speed, formation.settled_s, rate, trace.lost)
    return Summary(
        duration_s=(trace.end - trace.begin) / 1e9,
        mission_start_ns=phase.begin if phase is not None else None,
        drones=len(trace.swarm.flying),
        observation_error_m=observation,
        formation_error_m=formation,
        min_distance_uav_m=nearest,
        min_distance_obstacle_m=nearest_obstacle,
        max_speed_m_s=speed,
        latency_ms={hop: percentiles(latencies(trace, hop)) for hop in HOPS},
        deadlines=_deadlines(trace),
        messages=_messages(trace),
        rate=rate,
        missing=tuple(gaps.sentences),
        checks=checks(trace.swarm, measured, gaps.places, gaps.formation),
    )


class _Gaps:
    """What the trace lacks: `sentences`, and the reasons why positions or the formation cannot be judged."""

    def __init__(self, trace: Trace, phase: Span | None) -> None:
        flying = trace.swarm.flying
        self.placeless = [uav(number) for number in flying if not len(trace.positions(number))]
        self.places = f"no position of {', '.join(self.placeless)} was recorded" if self.placeless else ""
        self.formation = self._formation(trace, phase) or self.places
        silent = [uav(number) for number in trace.swarm.followers if not len(trace.of("estimate", number))]
        told = {vitals.last.identity for vitals in trace.vitals}
        mute = [name for name in map(trace.plan.pilot.__getitem__, trace.swarm.followers) if name not in told]
        sentences = {
            "the trace was not closed: its recorder did not end properly": not trace.closed,
            f"{trace.lost_bytes} bytes of the trace are incomplete": trace.lost_bytes,
            f"{trace.malformed} messages could not be decoded": trace.malformed,
            self.formation: self.formation,
            self.places: self.places,
            f"no estimate of {', '.join(silent)} was recorded": silent,
            f"no status of {', '.join(mute)} was recorded": mute,
        }
        self.sentences = [f"{text[0].upper()}{text[1:]}." for text, holds in sentences.items() if holds]

    @staticmethod
    def _formation(trace: Trace, phase: Span | None) -> str:
        starts = [mission for mission in trace.missions if mission.verb == "start"]
        unknown = next((m.formation for m in starts if formation_of(trace, m) is None), None)
        if not starts:
            return "no mission `start` was recorded, so there was no formation to judge"
        if phase is None:
            return "the trace ends before the formation's time 0"
        if unknown is not None:
            return f"the swarm has no formation {unknown!r}, which was started"
        return "" if len(trace.positions(0)) else "no pose of the leader, uav0, was recorded"


def _rate(trace: Trace, number: int, phase: Span | None) -> float | None:
    if phase is None:
        return None
    commands = int(phase.holds(trace.of("command", number).published).sum())
    return commands / (phase.length * trace.swarm.control.rate_hz)


def _deadlines(trace: Trace) -> Deadlines:
    agents = {trace.plan.pilot[number] for number in trace.swarm.followers}
    last = [vitals.last for vitals in trace.vitals if vitals.last.identity in agents]
    return Deadlines(
        sum(status.steps for status in last),
        sum(status.late_1ms for status in last),
        sum(status.late_5ms for status in last),
        sum(status.skipped for status in last),
    )


def _messages(trace: Trace) -> Messages:
    by_key: Counter[str] = Counter()
    for vitals in trace.vitals:
        by_key.update(dict(vitals.last.rejected))
    return Messages(trace.recorded, trace.lost, by_key.total(), dict(by_key.most_common()))

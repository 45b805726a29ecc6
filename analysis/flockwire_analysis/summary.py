"""The figures and the verdict of a flight, computed from its trace."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.model import uav
from flockwire_core.wire.information import relays
from flockwire_core.wire.processes import GATEWAY
from flockwire_core.wire.status import CONFLICTS, FILTERED, LAW_STEPS

from flockwire_analysis import gaps, separation, tracking
from flockwire_analysis.checks import checks, kept_within
from flockwire_analysis.free_places import undisturbed
from flockwire_analysis.key_figures import Messages, PhaseFigures, StepFigures, Summary, long_enough
from flockwire_analysis.latency import HOPS, latencies, percentiles
from flockwire_analysis.phases import FormationPhase, Span, airborne, formation_phases, formations_of
from flockwire_analysis.recorded import Trace
from flockwire_analysis.separation import cannot_be_had
from flockwire_analysis.series import Booleans


def summarise(trace: Trace) -> Summary:
    """Compute all figures of a flight; an unknown one is None, named in `missing`, and fails its check."""
    phases = formation_phases(trace)
    lacking = _Lacking(trace, phases)
    figures = _figures(trace, phases)
    judged = long_enough(figures)
    apart, clear, speed, outside = _distances(trace) if not lacking.placeless else (None, None, None, None)
    spans = [phase.span for phase in phases]
    filtered, conflicts = _filtered(trace)
    summary = Summary(
        duration_s=(trace.end - trace.begin) / 1e9,
        mission_start_ns=spans[0].begin if spans else None,
        drones=len(trace.flying),
        left_out=tuple(map(uav, trace.left_out)),
        observation_error_m=tracking.worst([phase.observation_error_m for phase in judged]),
        formation_error_m=tracking.worst([phase.formation_error_m for phase in judged]),
        min_distance_uav_m=apart,
        min_distance_obstacle_m=clear,
        max_speed_m_s=speed,
        max_outside_m=outside,
        latency_ms={hop: percentiles(latencies(trace, hop)) for hop in HOPS},
        steps=_steps(trace),
        messages=_messages(trace),
        tracker=bad_input(trace).get(GATEWAY.kind, {}),
        rate={trace.plan.pilot[i]: gaps.control_rate(trace, i, spans) for i in trace.followers},
        filtered=filtered,
        conflicts=conflicts,
        missing=tuple(lacking.sentences),
        phases=figures,
    )
    return replace(summary, checks=checks(trace, summary, lacking.places, lacking.formation))


def bad_input(trace: Trace) -> dict[str, dict[str, int]]:
    """Return each process's counts of bad input by name, those of its restarts added."""
    found: dict[str, Counter[str]] = {}
    for vitals in trace.vitals:
        found.setdefault(vitals.last.identity, Counter()).update(dict(vitals.last.report.counts))
    for counts in found.values():
        del counts[LAW_STEPS], counts[FILTERED], counts[CONFLICTS]
    return {identity: dict(counts) for identity, counts in found.items() if counts}


def _filtered(trace: Trace) -> tuple[float, float] | tuple[None, None]:
    """Return the worst drone's share of changed commands but for conflicts, and that of these."""
    counts = [dict(vitals.last.report.counts) for vitals in trace.vitals]
    changed = [(one.get(FILTERED, 0), one.get(CONFLICTS, 0), one[LAW_STEPS]) for one in counts if one.get(LAW_STEPS)]
    return max([((all_ - other) / steps, other / steps) for all_, other, steps in changed], default=(None, None))


def _figures(trace: Trace, phases: tuple[FormationPhase, ...]) -> tuple[PhaseFigures, ...]:
    if not phases:
        return ()
    observation, formation = tracking.observation_errors(trace), tracking.formation_errors(trace)
    without = {
        i: np.zeros(len(error.stamps), np.bool_) if error.places is None else cannot_be_had(trace, error.places)
        for i, error in formation.items()
    }
    judged = {
        i: tracking.Errors(error.stamps, np.where(without[i], 0.0, error.values)) for i, error in formation.items()
    }
    origin = phases[0].span.begin
    steady = undisturbed(trace, judged)
    found = []
    for phase in phases:
        span = phase.span
        errors = tracking.figures(formation, span, judged)
        since = errors.settled_s
        settled = span.tail() if since is None else Span(span.begin + nanoseconds(since), span.end)
        off = tracking.longest_off(judged, steady, settled, kept_within(trace.swarm))
        found.append(PhaseFigures(
            phase.order.formation, (span.begin - origin) / SECOND, span.length,
            tracking.figures(observation, span, observation), errors,
            tracking.largest_tail(judged, steady, span, settled), None if since is None else off,
            _without_places(formation, without, span),
        ))  # fmt: skip
    return tuple(found)


def _without_places(errors: dict[int, tracking.Errors], without: dict[int, Booleans], span: Span) -> dict[str, float]:
    """Return for how long, s, within `span` each follower was `without` a place that can be had, if it was."""
    found = {}
    for number, error in errors.items():
        within = span.holds(error.stamps)
        seconds = float(np.diff(error.stamps[within])[without[number][within][:-1]].sum()) / SECOND
        if seconds > 0.0:
            found[uav(number)] = seconds
    return found


def _distances(trace: Trace) -> tuple[float | None, float | None, float | None, float | None]:
    """Return the smallest distances between drones and to obstacles, m, the highest speed, m/s, the most outside, m."""
    flight = airborne(trace)
    times = separation.common_times(flight)
    obstacles = separation.obstacle_distances(trace, times) if trace.swarm.obstacles else {}
    movers = separation.mover_distances(trace, flight)
    return (
        separation.smallest([*separation.nearest_drones(trace, times).values()]),
        separation.smallest([*obstacles.values(), *movers.values()]),
        separation.max_speed(trace, flight),
        separation.max_outside(trace, flight),
    )


class _Lacking:
    """The missing data: `sentences`, and the reasons why positions or the formation cannot be judged."""

    def __init__(self, trace: Trace, phases: tuple[FormationPhase, ...]) -> None:
        flying = trace.flying
        self.placeless = [uav(number) for number in flying if not len(trace.positions(number))]
        self.places = f"no position of {', '.join(self.placeless)} was recorded" if self.placeless else ""
        self.formation = self._formation(trace, bool(phases)) or self.places
        sentences = {
            "the trace was not closed: its recorder did not end properly": not trace.closed,
            f"{trace.lost_bytes} bytes of the trace are incomplete": trace.lost_bytes,
            f"{trace.malformed} messages are malformed, or of another day": trace.malformed,
            (beside := gaps.beside(trace)): beside,
            self.formation: self.formation,
            self.places: self.places,
            f"no estimate of {', '.join(unknown := _without_estimate(trace))} was recorded": unknown,
            f"no status of {', '.join(unreported := _without_status(trace))} was recorded": unreported,
        }
        self.sentences = [f"{text[0].upper()}{text[1:]}." for text, holds in sentences.items() if holds]

    @staticmethod
    def _formation(trace: Trace, begun: bool) -> str:
        starts = [mission for mission in trace.missions if mission.in_formation]
        unknown = next((m.formation for m in starts if formations_of(trace, m) is None), None)
        if not starts:
            return "no mission `start` was recorded, so there was no formation to judge"
        if not begun:
            return "the trace ends before the formation's time 0"
        if unknown is not None:
            return f"the swarm has no formation {unknown!r}, which was started"
        sole = trace.swarm.sole_leader
        return "" if sole is None or len(trace.leader) else f"no pose of the leader, {uav(sole)}, was recorded"


def _without_estimate(trace: Trace) -> list[str]:
    estimating = trace.followers if relays(trace.swarm) else ()
    return [uav(number) for number in estimating if not len(trace.of("estimate", number))]


def _without_status(trace: Trace) -> list[str]:
    reporting = {vitals.last.identity for vitals in trace.vitals}
    return [name for name in map(trace.plan.pilot.__getitem__, trace.followers) if name not in reporting]


def _steps(trace: Trace) -> StepFigures:
    agents = {trace.plan.pilot[number] for number in trace.followers}
    last = [vitals.last for vitals in trace.vitals if vitals.last.identity in agents]
    return StepFigures(
        sum(status.steps for status in last),
        sum(status.delayed_1ms for status in last),
        sum(status.delayed_5ms for status in last),
        sum(status.skipped for status in last),
    )


def _messages(trace: Trace) -> Messages:
    by_key: Counter[str] = Counter()
    for vitals in trace.vitals:
        by_key.update(dict(vitals.last.rejected))
    return Messages(trace.recorded, trace.lost, by_key.total(), dict(by_key.most_common()))

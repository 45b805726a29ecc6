"""The checks of a flight; docs/checks.md explains each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.information import relays
from flockwire_core.wire.status import APART, LAW_FAILED, LAW_SLOW, LEFT_OUT

from flockwire_analysis import gaps, outcomes
from flockwire_analysis.conformance import deviations
from flockwire_analysis.key_figures import Check, PhaseFigures, Summary
from flockwire_analysis.phases import formation_phases, shared_places
from flockwire_analysis.recorded import Trace
from flockwire_analysis.separation import outside_fence
from flockwire_analysis.tracking import SETTLED_BELOW, largest, own_places

OFF = "not judged ([checks] of the swarm file)"
NO_ERRORS = "some followers have no errors in this period"
OWN_ERROR = "without one leader it is the `error` of the law's Decision"
ABOUT_THE_RECORD = frozenset({"control rate", "recording", "lost messages"})  # they judge the recording, not the flight


def kept_within(swarm: Swarm) -> float:
    """Return the largest distance, m, of a follower that counts as at its place."""
    return max(swarm.checks.formation_tail, SETTLED_BELOW)


def checks(trace: Trace, figures: Summary, no_places: str, no_formation: str) -> tuple[Check, ...]:
    """Judge a flight by its `figures`; `no_places` and `no_formation`: why there are no distances, or no formation."""
    longest_off = largest([phase.longest_off_s for phase in figures.judged])
    idle = {
        "formation kept": longest_off is None,  # no follower settled: judged by another check
        "contradictions": not _contradictions(trace),
        "laws that failed": not trace.reasons[LAW_FAILED],
        "observation tail": not relays(trace.swarm),  # nobody estimates the leader
        "obstacle clearance": not trace.swarm.obstacles and figures.min_distance_obstacle_m is None,
        "separation": figures.drones < 2,
    }
    found = (
        *_in_flight(trace, figures, no_places),
        *_formation(trace, figures, longest_off, no_formation),
        *_drones(trace),
        *_record(trace, figures, no_formation),
    )
    off = trace.swarm.checks.off
    judged = (replace(check, ok=True, rule=OFF, judged=False) if check.name in off else check for check in found)
    return tuple(check for check in judged if not idle.get(check.name))


def _in_flight(trace: Trace, figures: Summary, no_places: str) -> tuple[Check, ...]:
    speed_tolerance = 0.02  # share by which a speed from noisy positions may exceed its limit
    safe, speed = trace.swarm.avoidance, trace.swarm.limits.speed
    nowhere = no_places or "no two drones had poses at the same time"
    return (
        _at_least("separation", figures.min_distance_uav_m, safe.drone_safety_distance, "m", nowhere),
        _at_least("obstacle clearance", figures.min_distance_obstacle_m, safe.obstacle_safety_distance, "m", nowhere),
        _at_most(
            "speed", figures.max_speed_m_s, speed, "m/s", nowhere, "(2 % measuring tolerance)",
            tolerance=speed_tolerance,
        ),
        _at_most("fence", figures.max_outside_m, trace.swarm.checks.fence, "m", nowhere, "outside limits.fence"),
        _none("emergency stop", tuple(dict.fromkeys(stop.reason for stop in trace.stops))),
        _none("laws that failed", trace.reasons[LAW_FAILED]),
        _none("contradictions", _contradictions(trace)),
    )  # fmt: skip


def _contradictions(trace: Trace) -> tuple[str, ...]:
    """Return a sentence for each input that a pilot took for false."""
    return (*trace.reasons[LEFT_OUT], *trace.reasons[APART])


def _formation(trace: Trace, figures: Summary, longest_off: float | None, missing: str) -> tuple[Check, ...]:
    bounds = trace.swarm.checks
    unsettled = missing or _unsettled(figures.judged)
    settled = None if unsettled else figures.formation_error_m.settled_s
    unknown = missing or (NO_ERRORS if trace.swarm.sole_leader is not None else f"{NO_ERRORS}; {OWN_ERROR}")
    observation, tail = figures.observation_error_m.max_tail, "in the last 30 % of each phase"
    return (
        _at_most("formation settled", settled, bounds.settle_within, "s", unsettled, "after the start of each"),
        _at_most(
            "formation kept", longest_off, bounds.off_place, "s", "",
            f"more than {kept_within(trace.swarm):g} m off its place after all had settled, except near obstacles",
        ),
        _none("places", (*_places_outside(trace), *shared_places(trace, bounds.settle_within))),
        _at_most(
            "formation tail", largest([phase.judged_tail_m for phase in figures.judged]), bounds.formation_tail, "m",
            unknown, "in the last 30 % of each phase, except near obstacles",
        ),
        _at_most("observation tail", observation, bounds.observation_tail, "m", unknown, tail),
    )  # fmt: skip


def _unsettled(phases: Sequence[PhaseFigures]) -> str:
    """Return the phase that did not settle, empty if all did."""
    for phase in phases:
        if phase.formation_error_m.settled_s is None:
            name = f"formation {phase.formation!r}" if phase.formation else "the formation"
            when = f"{name}, from {phase.begin_s:.1f} s on, {phase.length_s:.1f} s long"
            return f"the followers did not stay within {SETTLED_BELOW:g} m of their places for 2 s ({when})"
    return ""


def _places_outside(trace: Trace) -> tuple[str, ...]:
    """Return a sentence for each follower whose place leaves the fence in a formation phase."""
    spans = [phase.span for phase in formation_phases(trace)]
    stamps = np.concatenate([span.instants(max(2, round(10.0 * span.length))) for span in spans] or [np.empty(0, int)])
    return tuple(
        f"the place of {uav(number)} leaves limits.fence"
        for number in trace.followers
        if outside_fence(trace, own_places(trace, number, stamps)).any()
    )


def _drones(trace: Trace) -> tuple[Check, ...]:
    found = (
        _none("on the ground in formation", outcomes.grounded(trace)),
        _none("lost drones", outcomes.lost(trace)),
        _none("conformance", deviations(trace)),
    )
    if trace.stops:  # no landing to judge
        return found
    landing, radius = outcomes.landing(trace), trace.swarm.checks.landing_radius
    if landing.not_down or landing.distance is None:
        ok, reason = not landing.not_down, _listed(landing.not_down) or "no landing was recorded"
        return *found, Check("landed", None, radius, ok, "", "m", reason)
    rule = "from where the landing began"
    return *found, _at_most("landed", landing.distance, radius, "m", "", rule, landing.drone)


def _record(trace: Trace, figures: Summary, no_formation: str) -> tuple[Check, ...]:
    bounds, gap = trace.swarm.checks, gaps.longest_gap(trace)
    slowest = min((share for share in figures.rate.values() if share is not None), default=None)
    where = gaps.where(trace, gap) if gap.length > bounds.recording_gap else ""
    slow = tuple({text.partition(":")[0]: text for text in trace.reasons[LAW_SLOW]}.values())  # the last of each drone
    return (
        _at_least("control rate", slowest, bounds.control_rate, "of the steps", no_formation, _listed(slow)),
        _at_most("recording", gap.length, bounds.recording_gap, "s", "", "without recorded messages", where),
        Check("lost messages", float(trace.lost), 0.0, trace.lost == 0, "none"),
    )


def _none(name: str, sentences: tuple[str, ...]) -> Check:
    return Check(name, float(len(sentences)), 0.0, not sentences, "none", reason=_listed(sentences))


def _listed(sentences: tuple[str, ...]) -> str:
    most_named = 4  # drones that the sentence of a check names
    more = len(sentences) - most_named
    return "; ".join(sentences[:most_named]) + (f"; and {more} more" if more > 0 else "")


def _at_least(name: str, value: float | None, limit: float, unit: str, reason: str, note: str = "") -> Check:
    ok = value is not None and value >= limit
    return Check(name, value, limit, ok, f"at least {limit:g} {unit}", unit, note if value is not None else reason)


def _at_most(
    name: str, value: float | None, limit: float, unit: str, reason: str, rule: str, note: str = "",
    tolerance: float = 0.0,
) -> Check:  # fmt: skip
    ok, reason = (False, reason) if value is None else (value <= limit * (1.0 + tolerance), note)
    return Check(name, value, limit, ok, f"at most {limit:g} {unit} {rule}", unit, reason)

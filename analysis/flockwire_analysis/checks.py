"""The checks of a flight; docs/checks.md explains each."""

from __future__ import annotations

from dataclasses import dataclass

from flockwire.swarm.model import Swarm

from flockwire_analysis.gaps import Gap
from flockwire_analysis.outcomes import LandingFigures
from flockwire_analysis.tracking import SETTLED_BELOW

SPEED_TOLERANCE = 0.02  # share by which a speed from noisy positions may exceed its limit
MOST_NAMED = 4  # drones that the sentence of a check names
ABOUT_THE_RECORD = frozenset({"control rate", "recording", "lost messages"})  # they judge the recording, not the flight


@dataclass(frozen=True, slots=True)
class Check:
    """One check: `value` against `limit`, both in `unit`; `reason` is why there is no value, or its origin."""

    name: str
    value: float | None
    limit: float | None
    ok: bool
    rule: str  # in words
    unit: str = ""
    reason: str = ""

    def as_json(self) -> dict[str, object]:
        """Return the entry of this check in summary.json."""
        return {"name": self.name, "value": self.value, "limit": self.limit, "ok": self.ok}

    def found(self) -> str:
        """Return the result as text."""
        if self.value is None:
            return self.reason
        value = f"{self.value:.4g} {self.unit}".strip()
        return f"{value} ({self.reason})" if self.reason else value

    def sentence(self) -> str:
        """Return the result and the rule as text."""
        return f"{self.name}: {self.found()}" + (f", must be {self.rule}" if self.value is not None else "")


@dataclass(frozen=True, slots=True)
class Measured:
    """The values to check: lengths in m, speed in m/s, times in s, share of the steps by agent, sentences on drones.

    `no_places` and `no_formation` are why there are no distances, or no formation; else empty.
    """

    no_places: str
    no_formation: str
    drones: int
    min_distance_uav: float | None
    min_distance_obstacle: float | None
    max_speed: float | None
    max_outside: float | None
    stops: tuple[str, ...]
    settled: float | None
    failed_laws: tuple[str, ...]
    contradictions: tuple[str, ...]
    unsettled: str  # the phase that did not settle
    longest_off: float | None
    outside: tuple[str, ...]  # places that leave the fence
    formation_tail: float | None
    observation_tail: float | None
    grounded: tuple[str, ...]
    lost_drones: tuple[str, ...]
    deviations: tuple[str, ...]
    landing: LandingFigures
    rate: dict[str, float | None]
    gap: Gap
    gap_place: str
    lost: int


def kept_within(swarm: Swarm) -> float:
    """Return the largest distance, m, of a follower that counts as at its place."""
    return max(swarm.checks.formation_tail, SETTLED_BELOW)


def checks(swarm: Swarm, measured: Measured) -> tuple[Check, ...]:
    """Judge the measured values."""
    found = [*_in_flight(swarm, measured), *_formation(swarm, measured), *_drones(swarm, measured)]
    alone = not swarm.obstacles and measured.min_distance_obstacle is None
    idle = {
        "formation kept": measured.longest_off is None,  # no follower settled: judged by another check
        "contradictions": not measured.contradictions,
        "laws that failed": not measured.failed_laws,
        "obstacle clearance": alone,
        "separation": measured.drones < 2,
    }
    return tuple(check for check in (*found, *_record(swarm, measured)) if not idle.get(check.name))


def _in_flight(swarm: Swarm, measured: Measured) -> tuple[Check, ...]:
    safe, speed = swarm.avoidance, swarm.limits.speed
    nowhere = measured.no_places or "no two drones had poses at the same time"
    fast_enough = measured.max_speed is not None and measured.max_speed <= speed * (1.0 + SPEED_TOLERANCE)
    return (
        _at_least("separation", measured.min_distance_uav, safe.drone_safety_distance, "m", nowhere),
        _at_least("obstacle clearance", measured.min_distance_obstacle, safe.obstacle_safety_distance, "m", nowhere),
        Check(
            "speed", measured.max_speed, speed, fast_enough, f"at most {speed:g} m/s (2 % measuring tolerance)", "m/s",
            "" if measured.max_speed is not None else nowhere,
        ),
        _at_most("fence", measured.max_outside, swarm.checks.fence, "m", nowhere, "outside limits.fence"),
        _none("emergency stop", measured.stops),
        _none("laws that failed", measured.failed_laws),
        _none("contradictions", measured.contradictions),
    )  # fmt: skip


def _formation(swarm: Swarm, measured: Measured) -> tuple[Check, ...]:
    bounds, missing = swarm.checks, measured.no_formation
    unsettled = missing or measured.unsettled
    settled = None if unsettled else measured.settled
    unknown = missing or "some followers have no errors in this period"
    return (
        _at_most("formation settled", settled, bounds.settle_within, "s", unsettled, "after the start of each"),
        _at_most(
            "formation kept", measured.longest_off, bounds.off_place, "s", "",
            f"more than {kept_within(swarm):g} m off its place after all had settled, except near obstacles",
        ),
        _none("places", measured.outside),
        _at_most(
            "formation tail", measured.formation_tail, bounds.formation_tail, "m", unknown,
            "in the last 30 % of each phase, except near obstacles",
        ),
        _at_most(
            "observation tail", measured.observation_tail, bounds.observation_tail, "m", unknown,
            "in the last 30 % of each phase",
        ),
    )  # fmt: skip


def _drones(swarm: Swarm, measured: Measured) -> tuple[Check, ...]:
    landing, radius = measured.landing, swarm.checks.landing_radius
    grounded = _none("on the ground in formation", measured.grounded)
    lost = _none("lost drones", measured.lost_drones)
    found = (grounded, lost, _none("conformance", measured.deviations))
    if measured.stops:  # no landing to judge
        return found
    if landing.not_down or landing.distance is None:
        ok, reason = not landing.not_down, _listed(landing.not_down) or "no landing was recorded"
        return *found, Check("landed", None, radius, ok, "", "m", reason)
    rule = "from where the landing began"
    return *found, _at_most("landed", landing.distance, radius, "m", "", rule, landing.drone)


def _record(swarm: Swarm, measured: Measured) -> tuple[Check, ...]:
    slowest = min((share for share in measured.rate.values() if share is not None), default=None)
    gap, longest = measured.gap, swarm.checks.recording_gap
    where = measured.gap_place if gap.length > longest else ""
    return (
        _at_least("control rate", slowest, swarm.checks.control_rate, "of the steps", measured.no_formation),
        _at_most("recording", gap.length, longest, "s", "", "without recorded messages", where),
        Check("lost messages", float(measured.lost), 0.0, measured.lost == 0, "none"),
    )


def _none(name: str, sentences: tuple[str, ...]) -> Check:
    return Check(name, float(len(sentences)), 0.0, not sentences, "none", reason=_listed(sentences))


def _listed(sentences: tuple[str, ...]) -> str:
    more = len(sentences) - MOST_NAMED
    return "; ".join(sentences[:MOST_NAMED]) + (f"; and {more} more" if more > 0 else "")


def _at_least(name: str, value: float | None, limit: float, unit: str, reason: str) -> Check:
    ok = value is not None and value >= limit
    return Check(name, value, limit, ok, f"at least {limit:g} {unit}", unit, "" if value is not None else reason)


def _at_most(name: str, value: float | None, limit: float, unit: str, reason: str, rule: str, note: str = "") -> Check:
    ok = value is not None and value <= limit
    return Check(
        name, value, limit, ok, f"at most {limit:g} {unit} {rule}", unit, note if value is not None else reason
    )

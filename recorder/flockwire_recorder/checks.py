"""What a flight must have kept to."""

from __future__ import annotations

from dataclasses import dataclass

from flockwire.swarm.model import Swarm

SPEED_TOLERANCE = 0.02  # share by which a speed measured from noisy positions may exceed its limit
LEAST_RATE = 0.95  # share of the control rate that the slowest agent must reach


@dataclass(frozen=True, slots=True)
class Check:
    """One check: `value` against `limit`, both in `unit`; `reason` says why there is no value."""

    name: str
    value: float | None
    limit: float | None
    ok: bool
    rule: str  # in words
    unit: str = ""
    reason: str = ""

    def as_json(self) -> dict[str, object]:
        """Return what summary.json says of this check."""
        return {"name": self.name, "value": self.value, "limit": self.limit, "ok": self.ok}

    def sentence(self) -> str:
        """Say what this check found."""
        if self.value is None:
            return f"{self.name}: {self.reason}"
        return f"{self.name}: {f'{self.value:.4g} {self.unit}'.strip()}, must be {self.rule}"


@dataclass(frozen=True, slots=True)
class Measured:
    """What is checked: distances in m, speed in m/s, settling time in s, share of the steps by agent, lost messages."""

    min_distance_uav: float | None
    min_distance_obstacle: float | None
    max_speed: float | None
    settled: float | None
    rate: dict[str, float | None]
    lost: int


def checks(swarm: Swarm, measured: Measured, no_places: str, no_formation: str) -> tuple[Check, ...]:
    """Judge what was measured; `no_places` and `no_formation` say why there are no distances, or is no formation."""
    safe = swarm.avoidance
    slowest = min((share for share in measured.rate.values() if share is not None), default=None)
    speed_limit = swarm.limits.speed * (1.0 + SPEED_TOLERANCE)
    unsettled = no_formation or "the followers did not stay within 0.1 m of their places for 2 s"
    nowhere = no_places or "no two drones were seen at one time"
    found = [
        _at_least("separation", measured.min_distance_uav, safe.drone_safety_distance, "m", nowhere),
        _at_least("obstacle clearance", measured.min_distance_obstacle, safe.obstacle_safety_distance, "m", nowhere),
        Check(
            "speed", measured.max_speed, swarm.limits.speed, _within(measured.max_speed, speed_limit),
            f"at most {swarm.limits.speed:g} m/s (2 % measuring tolerance)", "m/s", nowhere,
        ),
        Check(
            "formation settled", measured.settled, None, measured.settled is not None,
            "within 0.1 m for 2 s, at any time", "s", unsettled,
        ),
        _at_least("control rate", slowest, LEAST_RATE, "of the steps", no_formation),
        Check("lost messages", float(measured.lost), 0.0, measured.lost == 0, "none"),
    ]  # fmt: skip
    idle = {"obstacle clearance": not swarm.obstacles, "separation": len(swarm.flying) < 2}
    return tuple(check for check in found if not idle.get(check.name))


def _at_least(name: str, value: float | None, limit: float, unit: str, reason: str) -> Check:
    return Check(name, value, limit, value is not None and value >= limit, f"at least {limit:g} {unit}", unit, reason)


def _within(value: float | None, limit: float) -> bool:
    return value is not None and value <= limit

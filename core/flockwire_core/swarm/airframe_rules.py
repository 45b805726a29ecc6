"""The rules of a swarm file for each row of the airframe table: tables, cameras, own reactions."""

from __future__ import annotations

from collections.abc import Iterator

from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.validation import Problem


def tables(swarm: Swarm) -> Iterator[Problem]:
    """Yield tables of drones with another kind."""
    for place, drone in enumerate(swarm.drones):
        frame = swarm.airframes[drone.airframe]
        for row in AIRFRAMES:
            if frame.kind != row.kind and getattr(drone, row.kind, None) is not None:
                which = f"airframe {drone.airframe!r} is of kind {frame.kind!r}"
                yield Problem(f"drones.{place}.{row.kind}", f"{which}, must be {row.kind!r}")


def cameras(swarm: Swarm) -> Iterator[Problem]:
    """Yield real drones that simulated cameras do not see."""
    for place, drone in enumerate(swarm.drones if swarm.gateway.source == "simulated" else ()):
        if drone.id in swarm.flying and swarm.real_address(drone.id) is not None:
            yield Problem(
                f"drones.{place}.{swarm.row(drone.id).kind}.address",
                f"no tracker sees {uav(drone.id)}, gateway.source = 'simulated'; set a real tracker, or remove the "
                "address to simulate the drone",
            )


def reactions(swarm: Swarm) -> Iterator[Problem]:
    """Yield limits of the staleness ladder that are slower than an airframe's own reaction."""
    for name in dict.fromkeys(swarm.drone(number).airframe for number in swarm.flying):
        row = swarm.airframe_row(name)
        for key, lost, by_itself in (
            ("command_land", "setpoints", row.without_setpoints),
            ("pose_land", "poses", row.without_poses),
            ("telemetry_land", "its link", row.without_link),
        ):
            if getattr(swarm.limits.staleness, key) >= by_itself.after:
                when = f"{by_itself.after:g} s, after which airframe {name!r} {by_itself.does} by itself without {lost}"
                yield Problem(f"limits.staleness.{key}", f"must be below {when}")


RULES = (tables, cameras, reactions)

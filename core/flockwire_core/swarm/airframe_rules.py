"""The rules of a swarm file for each row of the airframe table: tables, cameras, own reactions."""

from __future__ import annotations

from collections.abc import Iterator

from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.rules import needs


@needs("drones", "airframes")
def tables(swarm: Swarm) -> Iterator[str]:
    """Yield tables of drones with another kind."""
    for place, drone in enumerate(swarm.drones):
        frame = swarm.airframes.get(drone.airframe)
        for row in AIRFRAMES:
            if frame is not None and frame.kind != row.kind and getattr(drone, row.kind, None) is not None:
                which = f"airframe {drone.airframe!r} is of kind {frame.kind!r}"
                yield f"drones.{place}.{row.kind}: {which}, must be {row.kind!r}"


@needs("drones", "airframes", "gateway.source")
def cameras(swarm: Swarm) -> Iterator[str]:
    """Yield real drones that simulated cameras do not see."""
    for number in swarm.flying if swarm.gateway.source == "simulated" else ():
        if (address := swarm.real_address(number)) is not None:
            yield (
                f"drones.{swarm.row(number).kind}.address = {address!r}: no tracker sees {uav(number)}, "
                "gateway.source = 'simulated'; set a real tracker, or remove the address to simulate the "
                "drone"
            )


@needs("drones", "airframes", "limits.staleness")
def reactions(swarm: Swarm) -> Iterator[str]:
    """Yield limits of the staleness ladder that are slower than an airframe's own reaction."""
    stale = swarm.limits.staleness
    for name in dict.fromkeys(swarm.drone(number).airframe for number in swarm.flying):
        row = swarm.airframe_row(name)
        for key, lost, by_itself in (
            ("command_land", "setpoints", row.without_setpoints),
            ("pose_land", "poses", row.without_poses),
            ("telemetry_land", "its link", row.without_link),
        ):
            if (limit := getattr(stale, key)) >= by_itself.after:
                yield (
                    f"limits.staleness.{key} = {limit:g}: must be below {by_itself.after:g} s, after which airframe "
                    f"{name!r} {by_itself.does} by itself without {lost}"
                )


RULES = (tables, cameras, reactions)

"""The rules of a swarm file about its tracker: bodies, and the trace of a replay."""

from __future__ import annotations

from collections.abc import Iterator

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.rules import Rule
from flockwire_core.swarm.validation import Problem


def _bodies(swarm: Swarm) -> Iterator[Problem]:
    owners: dict[str | int, int] = {}
    for place, drone in enumerate(swarm.drones):
        key, body = f"drones.{place}.body", swarm.body(drone.id)
        if isinstance(body, int) and swarm.gateway.source != "natnet":
            yield Problem(key, "only gateway.source = 'natnet' numbers bodies; must be a name")
        if body in owners:
            yield Problem(key, f"drone {owners[body]} has this body", repr(body))
        owners[body] = drone.id
    for place, obstacle in enumerate(swarm.tracked_obstacles):
        key = f"tracked_obstacles.{place}.body"
        if obstacle.body in owners:
            yield Problem(key, f"drone {owners[obstacle.body]} has this body")
        if swarm.avoidance.sensing != "nearby":
            yield Problem(key, f"avoidance.sensing = {swarm.avoidance.sensing!r} does not sense it; must be 'nearby'")


def _replay(swarm: Swarm) -> Iterator[Problem]:
    if swarm.gateway.source == "replay" and not swarm.gateway.replay.trace:
        yield Problem("gateway.replay.trace", "gateway.source = 'replay' needs the trace.mcap of an earlier flight")


RULES: tuple[Rule, ...] = (_bodies, _replay)

"""The rules of a swarm file about ROS 2."""

from __future__ import annotations

import re
from collections.abc import Iterator

from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.ros import namespace_of
from flockwire_core.swarm.rules import Rule
from flockwire_core.swarm.validation import Problem


def _leader(swarm: Swarm) -> Iterator[Problem]:
    if len(_followed(swarm)) > 1:
        yield Problem("leaders", "one leader at most may be of kind 'ros'")
    for number in swarm.steered:
        if swarm.leading[number].follows_ros and swarm.ros is None:
            yield Problem(
                f"{swarm.leader.key(number)}.kind", "needs a table [ros], whose process receives leader.ros.topic"
            )


def _followed(swarm: Swarm) -> list[str]:
    """Return the topics that leaders follow."""
    return [leader.ros.topic for leader in swarm.leading.values() if leader.follows_ros]


def _own_topics(swarm: Swarm) -> Iterator[Problem]:
    """Yield topics to be received that the swarm publishes itself: it would follow itself."""
    if swarm.ros is None:
        return
    own = namespace_of(swarm.name, swarm.ros).rstrip("/")
    if any(topic.startswith(f"{own}/{uav(i)}/") for topic in _followed(swarm) for i in swarm.leaders):
        yield Problem("leader.ros.topic", "must not be a topic that this swarm publishes")
    table = swarm.gateway.ros
    if not swarm.gateway.from_ros or table.domain != swarm.ros.domain:
        return
    for i in swarm.tracked:
        theirs = table.array or table.topic.replace("{body}", str(swarm.body(i)))
        if theirs == f"{own}/{uav(i)}/pose":
            yield Problem("gateway.ros.topic", f"must not be a topic that this swarm publishes, {theirs}")


def _bodies(swarm: Swarm) -> Iterator[Problem]:
    table = swarm.gateway.ros
    for i in swarm.tracked if swarm.gateway.from_ros else ():
        body = str(swarm.body(i))
        if table.array is None and not re.fullmatch(r"\w+", body):
            yield Problem("gateway.ros.topic", f"body {body!r} of {uav(i)} cannot be part of a topic")
        if table.array is not None and table.bodies and body not in table.bodies:
            yield Problem("gateway.ros.bodies", f"must have body {body!r} of {uav(i)}")


def _once(swarm: Swarm) -> Iterator[Problem]:
    bodies = swarm.gateway.ros.bodies if swarm.gateway.from_ros else ()
    for body in sorted({body for body in bodies if bodies.count(body) > 1}):
        yield Problem("gateway.ros.bodies", f"has {body!r} twice")


def _services(swarm: Swarm) -> Iterator[Problem]:
    for name in swarm.formations if swarm.ros is not None and "formation" in swarm.ros.orders else ():
        if not re.fullmatch(r"[A-Za-z_]\w*", name):
            yield Problem(f"formations.{name}", "must be letters, digits and _, because ros.orders has it as a service")


RULES: tuple[Rule, ...] = (_leader, _own_topics, _bodies, _once, _services)

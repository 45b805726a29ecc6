"""Options without effect in a swarm file: one table for the warnings of `check`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from operator import attrgetter

from flockwire_core.swarm.gateway import Gateway
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import shown

Reason = Callable[[Swarm], str]  # what a file has that makes options idle; empty: nothing


def _is(key: str, *values: object) -> Reason:
    """Return the reason that `key` has one of `values`."""
    return lambda swarm: f"{key} = {shown(value)}" if (value := attrgetter(key)(swarm)) in values else ""


def _is_not(key: str, *values: object) -> Reason:
    """Return the reason that `key` has none of `values`."""
    return lambda swarm: f"{key} = {shown(value)}" if (value := attrgetter(key)(swarm)) not in values else ""


def _if(text: str, holds: Callable[[Swarm], object]) -> Reason:
    """Return the reason `text`, where it `holds`."""
    return lambda swarm: text if holds(swarm) else ""


def _both(one: Reason, other: Reason) -> Reason:
    """Return the reason that both are given."""
    return lambda swarm: f"{one(swarm)}, and {other(swarm)}" if one(swarm) and other(swarm) else ""


FILTER = _if("a safety filter", lambda swarm: swarm.control.filtered)
NO_FILTER = _if("no safety filter", lambda swarm: not swarm.control.filtered)
NOT_SENSING = _is("avoidance.sensing", "neighbours")
IDLE: tuple[tuple[Reason, tuple[str, ...]], ...] = (  # options, and the reason for which they have no effect
    (_is("control.law", "extended"), ("control.compensation_gain", "control.compensation_smoothing", "observer.step",
                                      "observer.velocity_time_constant")),
    (_both(_is("control.law", "extended"), FILTER), ("avoidance.drone_gain", "avoidance.obstacle_gain")),
    (_is("control.law", "paper"), ("observer.leader_time_constant",)),
    (_both(_is("control.law", "paper"), NO_FILTER), ("avoidance.barrier_rate",)),
    (NO_FILTER, ("limits.floor", "control.disturbance")),
    (NOT_SENSING,
     ("avoidance.sensing_radius", "limits.staleness.nearby_slow", "limits.staleness.nearby_hold")),
    (_both(NOT_SENSING, _if("no airframe with a driver of its own", lambda swarm: not swarm.driven)),
     ("limits.blind_speed",)),
    (_if("no simulated drone", lambda swarm: not swarm.simulated), ("wind.velocity", "wind.gust")),
    (_is("network.security", "none"), ("network.link",)),
    (_is_not("leader.kind", "teleoperated", "ros"), ("leader.acceleration", "limits.staleness.steering_stop")),
    (_is_not("leader.kind", "teleoperated", "ros", "tracked"), ("leader.speed",)),
    (_is_not("leader.kind", "trajectory", "ros"), ("leader.tracking_gain",)),
    (_is_not("leader.kind", "virtual"), ("leader.start",)),
    (_is("leader.kind", "teleoperated", "ros"), ("leader.trajectory",)),
    (_is_not("leader.kind", "ros"), ("leader.ros",)),
    (_is("gateway.source", "simulated"), ("gateway.rotation", "gateway.offset")),
    (_is_not("gateway.source", *Gateway.twins), ("gateway.twin",)),
    *((_is_not("gateway.source", source), (f"gateway.{source}",))
      for source in ("natnet", "vrpn", "qualisys", "vicon", "ros", "replay")),
    (_if("no gateway.ros.array", lambda swarm: swarm.gateway.ros.array is None), ("gateway.ros.bodies",)),
    (_is_not("gateway.ros.array", None), ("gateway.ros.topic",)),
    (_is("gateway.natnet.multicast", False), ("gateway.natnet.group", "gateway.natnet.data_port")),
)  # fmt: skip


def idle(swarm: Swarm) -> Iterator[str]:
    """Yield a line for each set option without effect."""
    for reason, options in IDLE:
        for option in options:
            path, _, last = option.rpartition(".")  # of a key or of a table
            if (because := reason(swarm)) and last in attrgetter(path)(swarm).model_fields_set:
                yield f"{option} is set but has no effect: the file has {because}"

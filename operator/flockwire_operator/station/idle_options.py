"""Options without effect in a swarm file: one table for the warnings of `check`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from operator import attrgetter

from flockwire_core.swarm.gateway import Gateway
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import shown

Reason = Callable[[Swarm], str]  # what a file has that makes options idle; empty: nothing


def _is(key: str, *values: object, other: bool = False) -> Reason:
    """Return the reason that `key` has one of `values`, or any `other` value."""
    return lambda swarm: f"{key} = {shown(value)}" if ((value := attrgetter(key)(swarm)) in values) != other else ""


def _if(text: str, holds: Callable[[Swarm], object]) -> Reason:
    """Return the reason `text`, where it `holds`."""
    return lambda swarm: text if holds(swarm) else ""


_is_not = partial(_is, other=True)
EXTENDED, PAPER = _is("control.law", "extended"), _is("control.law", "paper")
FILTER = _if("a safety filter", lambda swarm: swarm.control.filtered)
NO_FILTER = _if("no safety filter", lambda swarm: not swarm.control.filtered)
NOT_SENSING = _is("avoidance.sensing", "neighbours")
IDLE: tuple[tuple[tuple[str, ...], *tuple[Reason, ...]], ...] = (  # options, and what together makes them idle
    (("control.compensation_gain", "control.compensation_smoothing", "observer.step",
      "observer.velocity_time_constant"), EXTENDED),
    (("avoidance.drone_gain", "avoidance.obstacle_gain"), EXTENDED, FILTER),
    (("observer.leader_time_constant",), PAPER),
    (("avoidance.barrier_rate",), PAPER, NO_FILTER),
    (("limits.floor", "control.disturbance"), NO_FILTER),
    (("avoidance.sensing_radius", "limits.staleness.nearby_slow", "limits.staleness.nearby_hold"), NOT_SENSING),
    (("limits.blind_speed",),
     NOT_SENSING, _if("no airframe with a driver of its own", lambda swarm: not swarm.driven)),
    (("wind.velocity", "wind.gust"), _if("no simulated drone", lambda swarm: not swarm.simulated)),
    (("network.link",), _is("network.security", "none")),
    (("leader.acceleration", "limits.staleness.steering_stop"), _is_not("leader.kind", "teleoperated", "ros")),
    (("leader.speed",), _is_not("leader.kind", "teleoperated", "ros", "tracked")),
    (("leader.tracking_gain",), _is_not("leader.kind", "trajectory", "ros")),
    (("leader.start",), _is_not("leader.kind", "virtual")),
    (("leader.trajectory",), _is("leader.kind", "teleoperated", "ros")),
    (("leader.ros",), _is_not("leader.kind", "ros")),
    (("gateway.rotation", "gateway.offset"), _is("gateway.source", "simulated")),
    (("gateway.twin",), _is_not("gateway.source", *Gateway.twins)),
    *(((f"gateway.{source}",), _is_not("gateway.source", source))
      for source in ("natnet", "vrpn", "qualisys", "vicon", "ros", "replay")),
    (("gateway.ros.bodies",), _if("no gateway.ros.array", lambda swarm: swarm.gateway.ros.array is None)),
    (("gateway.ros.topic",), _is_not("gateway.ros.array", None)),
    (("gateway.natnet.group", "gateway.natnet.data_port"), _is("gateway.natnet.multicast", False)),
)  # fmt: skip


def idle(swarm: Swarm) -> Iterator[str]:
    """Yield a line for each set option without effect."""
    for options, *reasons in IDLE:
        found = [reason(swarm) for reason in reasons]
        for option in options if all(found) else ():
            path, _, last = option.rpartition(".")  # of a key or of a table
            if last in attrgetter(path)(swarm).model_fields_set:
                yield f"{option} is set but has no effect: the file has {', and '.join(found)}"

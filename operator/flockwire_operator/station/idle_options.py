"""Options without effect in a swarm file: one table for the warnings of `check`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from operator import attrgetter
from typing import NamedTuple

from flockwire_core.swarm.model import Swarm


class Idle(NamedTuple):
    """If `when` is true (the file has `because`), `options` have no effect."""

    because: str
    when: Callable[[Swarm], bool]
    options: tuple[str, ...]


def _of_source(source: str) -> Idle:
    """Return the row for the table of one gateway.source."""
    because = f"another gateway.source than {source!r}"
    return Idle(because, lambda swarm: swarm.gateway.source != source, (f"gateway.{source}",))


IDLE = (
    Idle(
        "control.law = 'extended'",
        lambda swarm: swarm.control.law == "extended",
        (
            "control.compensation_gain",
            "control.compensation_smoothing",
            "observer.step",
            "observer.velocity_time_constant",
        ),
    ),
    Idle(
        "control.law = 'extended' with its safety filter",
        lambda swarm: swarm.control.law == "extended" and swarm.control.filtered,
        ("avoidance.drone_gain", "avoidance.obstacle_gain", "avoidance.drone_influence_radius"),
    ),
    Idle("control.law = 'paper'", lambda swarm: swarm.control.law == "paper", ("observer.leader_time_constant",)),
    Idle(
        "control.law = 'paper' without a safety filter",
        lambda swarm: swarm.control.law == "paper" and not swarm.control.filtered,
        ("avoidance.sidestep_reach",),
    ),
    Idle(
        "no safety filter",
        lambda swarm: not swarm.control.filtered,
        ("avoidance.barrier_rate", "avoidance.margin", "limits.floor", "control.disturbance"),
    ),
    Idle(
        "avoidance.sensing = 'neighbours'",
        lambda swarm: swarm.avoidance.sensing == "neighbours",
        ("avoidance.sensing_radius", "limits.staleness.nearby_slow", "limits.staleness.nearby_hold"),
    ),
    Idle(
        "avoidance.sensing = 'neighbours', and no airframe with a driver of its own",
        lambda swarm: swarm.avoidance.sensing == "neighbours" and not swarm.driven,
        ("limits.blind_speed",),
    ),
    Idle("no simulated drone", lambda swarm: not swarm.simulated, ("wind.velocity", "wind.gust")),
    Idle("network.security = 'none'", lambda swarm: swarm.network.security == "none", ("network.link",)),
    Idle(
        "a leader that is not steered",
        lambda swarm: not swarm.leader.steered,
        ("leader.acceleration", "limits.staleness.steering_stop"),
    ),
    Idle("a leader that is not steered or carried", lambda swarm: not swarm.leader.unforeseen, ("leader.speed",)),
    Idle(
        "a leader of another kind than 'trajectory'",
        lambda swarm: swarm.leader.kind != "trajectory",
        ("leader.tracking_gain",),
    ),
    Idle("a leader of another kind than 'virtual'", lambda swarm: swarm.leader.kind != "virtual", ("leader.start",)),
    Idle("a leader that is steered", lambda swarm: swarm.leader.steered, ("leader.trajectory",)),
    Idle("another leader.kind than 'ros'", lambda swarm: not swarm.leader.follows_ros, ("leader.ros",)),
    Idle(
        "gateway.source = 'simulated'",
        lambda swarm: swarm.gateway.source == "simulated",
        ("gateway.rotation", "gateway.offset"),
    ),
    Idle(
        "a gateway.source that a simulated tracker cannot serve",
        lambda swarm: not swarm.gateway.simulates_tracker,
        ("gateway.twin",),
    ),
    *(_of_source(source) for source in ("natnet", "vrpn", "qualisys", "vicon", "ros", "replay")),
    Idle("gateway.ros.array", lambda swarm: swarm.gateway.ros.array is not None, ("gateway.ros.topic",)),
    Idle("no gateway.ros.array", lambda swarm: swarm.gateway.ros.array is None, ("gateway.ros.bodies",)),
    Idle(
        "gateway.natnet.multicast = false",
        lambda swarm: not swarm.gateway.natnet.multicast,
        ("gateway.natnet.group", "gateway.natnet.data_port"),
    ),
)


def idle(swarm: Swarm) -> Iterator[str]:
    """Yield a line for each set option without effect."""
    for row in IDLE:
        if row.when(swarm):
            for option in row.options:
                if _is_set(swarm, option):
                    yield f"{option} is set but has no effect: the file has {row.because}"


def _is_set(swarm: Swarm, option: str) -> bool:
    """Return whether the file sets it, as a key or as a table."""
    path, _, last = option.rpartition(".")
    return last in attrgetter(path)(swarm).model_fields_set

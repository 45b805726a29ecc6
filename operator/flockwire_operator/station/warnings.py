"""Warnings of `flockwire check`: settings that are allowed but unlikely to fly well, and those without effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from math import ceil, inf, sqrt
from operator import attrgetter
from pathlib import Path

from flockwire_core import clock
from flockwire_core.control.airframe.first_order_lag import critical_gain, smallest_smoothing
from flockwire_core.control.convergence import convergence
from flockwire_core.domain.vector import norm
from flockwire_core.objects import load_object
from flockwire_core.own_law import step_time
from flockwire_core.parameters import guard_parameters
from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.swarm.formation_rules import survey_of
from flockwire_core.swarm.gateway import Gateway
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.reading import stat_file
from flockwire_core.swarm.trajectories import leader_speed
from flockwire_core.swarm.wording import shown


def warnings(swarm: Swarm) -> Iterator[str]:
    """Yield warnings of settings that are allowed but unlikely to fly well."""
    yield from _observer_warnings(swarm)
    yield from _wind_warnings(swarm)
    yield from _slow_camera_warnings(swarm)
    yield from _law_warnings(swarm)
    yield from _replay_warnings(swarm)
    if swarm.control.law == "paper":
        yield from _paper_warnings(swarm)
    if swarm.control.filtered:
        yield from _sight_warnings(swarm)
    for row in AIRFRAMES:
        if row.warnings and swarm.of_kind(row):
            yield from load_object(row.warnings)(swarm)
    yield from idle(swarm)


def _observer_warnings(swarm: Swarm) -> Iterator[str]:
    deep = 6  # hops beyond which noise and delay add up
    if swarm.sole_leader is None:
        return
    observer = swarm.observer
    result = convergence(swarm.topology, observer.gain, observer.exponent, swarm.reference.input_bound)
    if result.margin <= 0.0 and not swarm.control.own_law:
        if result.smallest_gain == inf:
            yield (
                f"theta = {result.margin:.3f}: Lemma 3 proves nothing on this graph for any observer.gain (it is a "
                "sufficient condition; wide graphs fail it and converge all the same)"
            )
        else:
            yield (
                f"theta = {result.margin:.3f} <= 0: Lemma 3 does not prove convergence; observer.gain = "
                f"{observer.gain:g} must be above {result.smallest_gain:.2f} m/s"
            )
    if (deepest := swarm.depth) > deep:
        yield f"the deepest drone is {deepest} hops from the leader: noise and delay grow with every hop beyond {deep}"


def _law_warnings(swarm: Swarm) -> Iterator[str]:
    """Yield a warning if a step of the user's law takes longer than the control period on this machine."""
    period = 1.0 / swarm.control.rate_hz
    if swarm.control.own_law and (step := step_time(swarm, clock.monotonic)) > period:
        yield (
            f"control.law = {swarm.control.law!r}: a step takes {1e3 * step:.0f} ms here, control.rate_hz = "
            f"{swarm.control.rate_hz} leaves {1e3 * period:g} ms: a real flight misses steps; virtual time does not"
        )


def _replay_warnings(swarm: Swarm) -> Iterator[str]:
    """Yield a warning if the gateway's trace is not on this machine."""
    if swarm.gateway.source != "replay":
        return
    trace = swarm.gateway.replay.trace
    try:
        stat_file(Path(trace))
    except OSError as error:
        yield f"gateway.replay.trace = {trace!r}: {error.strerror} (the gateway reads it on its host, in its folder)"


def _wind_warnings(swarm: Swarm) -> Iterator[str]:
    compensated, most = swarm.control.compensated, norm(swarm.wind.velocity) + swarm.wind.gust
    if most > compensated and swarm.simulated:
        yield (
            f"the wind of up to {most:g} m/s is above what drones compensate, control.disturbance = {compensated:g}: "
            f"they will be up to {(most - compensated) / swarm.control.formation_gain:.2f} m off their places, or more"
        )

    for name, number in _kinds(swarm):
        if compensated and compensated >= (full := swarm.full_speed(number)):
            yield (
                f"control.disturbance = {compensated:g} m/s is not below {full:g} m/s, the highest speed of airframe "
                f"{name}: in such a wind it does not keep its place"
            )


def _slow_camera_warnings(swarm: Swarm) -> Iterator[str]:
    gateway, limit = swarm.gateway, swarm.limits.staleness.pose_zero
    if (oldest := 1.0 / gateway.rate_hz + gateway.latency) >= limit:
        yield (
            f"gateway.rate_hz = {gateway.rate_hz} with gateway.latency = {gateway.latency:g} s makes poses up to "
            f"{oldest:g} s old, limits.staleness.pose_zero = {limit:g} s keeps drones without newer ones on the ground"
        )


def _sight_warnings(swarm: Swarm) -> Iterator[str]:
    """Yield a warning if the safety filter limits the speed below what formation and leader need, with the remedy."""
    for name, number in _kinds(swarm):
        guard, needed = guard_parameters(swarm, number), survey_of(swarm).max_speed + leader_speed(swarm)
        if guard.fastest < min(needed, guard.speed):
            braking = guard.separation.drone + 2.0 * needed * guard.delay + needed * needed / guard.acceleration
            radius = max(braking, guard.separation.drone / 2.0 + 2.0 * needed * guard.silence)
            yield (
                f"avoidance.sensing_radius = {guard.sight:g} m lets airframe {name} fly {guard.fastest:.2f} m/s and "
                f"stop in time, formation and leader need {needed:.2f} m/s; {ceil(10.0 * radius) / 10.0:g} m or more "
                "would do"
            )


def _paper_warnings(swarm: Swarm) -> Iterator[str]:
    """Yield what (9) does not bear: a fast leader, high gains, an airframe that trails by A |h''| / K (ours).

    It knows no delay A.
    """
    control, acceleration, most = swarm.control, survey_of(swarm).max_acceleration, swarm.checks.formation_tail
    input_norm = swarm.reference.input_bound * sqrt(2.0)
    if control.compensation_gain < input_norm:
        yield (
            f"control.compensation_gain = {control.compensation_gain:g} m/s is below the leader's largest input, "
            f"{input_norm:.3f} m/s (leader.input_bound on both axes): (9) cannot compensate it"
        )
    for name, number in _kinds(swarm):
        frame = swarm.airframe(number)
        slowness = frame.lag + frame.dead_time + swarm.gateway.latency
        trail = slowness * acceleration / control.formation_gain
        if most and trail > most:
            yield (
                f"airframe {name} will trail its place by about {trail:.2f} m: law 'paper' compensates no lag (lag and "
                f"delays {slowness:.2f} s, the formation accelerates by {acceleration:.2g} m/s^2); control.law = "
                "'extended' would do, or a slower formation"
            )
    for number in swarm.followers:
        yield from _oscillation(swarm, number)


def _kinds(swarm: Swarm) -> Iterator[tuple[str, int]]:
    """Yield each airframe of followers, with one that has it."""
    found = {swarm.drone(number).airframe: number for number in reversed(swarm.followers)}
    return iter(sorted(found.items()))


def _oscillation(swarm: Swarm, number: int) -> Iterator[str]:
    """Predict a limit cycle: the slope of (9) at zero error against the airframe's lag and all delays of the loop."""
    control, frame = swarm.control, swarm.airframe(number)
    delay = frame.dead_time + swarm.gateway.latency + 1.0 / control.rate_hz
    slope = frame.gain * (control.formation_gain + control.compensation_gain / control.compensation_smoothing)
    critical = critical_gain(frame.lag, delay)
    if slope <= critical:
        return
    least = smallest_smoothing(control.formation_gain, control.compensation_gain, frame.lag, delay)
    cure = (
        f"control.compensation_smoothing of {least:.2f} m or more would do"
        if least is not None
        else f"control.formation_gain = {control.formation_gain:g} alone is too high for it"
    )
    yield (
        f"{uav(number)} will oscillate: gain K + phi/eps = {slope:.0f} /s, its airframe (lag {frame.lag:g} s, delays "
        f"{delay:.3f} s) bears {critical:.1f} /s; {cure}"
    )


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

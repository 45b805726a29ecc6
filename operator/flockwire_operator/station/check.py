"""`flockwire check`: the description and the warnings of a swarm before it flies."""

from __future__ import annotations

import os
from collections.abc import Iterator
from math import ceil, inf, sqrt
from pathlib import Path

# One thread: the threads of numpy's library wait for each other in busy loops. If other processes use the cores, an
# eigenvalue of 1000 drones takes twelve seconds instead of one. It is read at numpy's import.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from flockwire_core import clock
from flockwire_core.control.airframe.first_order_lag import critical_gain, smallest_smoothing
from flockwire_core.control.convergence import convergence
from flockwire_core.control.leader_track import motion_error, noise_gain
from flockwire_core.domain.vector import norm
from flockwire_core.objects import load_object
from flockwire_core.own_law import Checked, law_check, step_time
from flockwire_core.parameters import guard_parameters, leader_time_constant
from flockwire_core.swarm.airframes import AIRFRAMES, ByItself
from flockwire_core.swarm.formation_rules import survey_of
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.reading import stat_file
from flockwire_core.swarm.trajectories import course_of, leader_speed
from flockwire_core.wire.plan import Plan, port_of

from flockwire_operator.station.idle_options import idle
from flockwire_operator.station.prediction import predicted


def describe(plan: Plan, duration: float = 40.0, law: Checked | None = None) -> str:
    """Return the description for `check`; `duration` is the flight's, s, `law` what the law's own check returned."""
    swarm = plan.swarm
    parts = (
        _graph(plan),
        (*_lemma(swarm), *_depth(swarm), *_law(swarm, law or law_check(swarm))),
        _formations(swarm, duration),
        _airframes(plan),
        (f"not judged after a flight ([checks]): {', '.join(off)}",) if (off := sorted(swarm.checks.off)) else (),
        _links(plan),
        (f"warning: {line}" for line in (*warnings(swarm), *predicted(swarm, duration))),
    )
    return "\n\n".join(filter(None, map("\n".join, parts)))


def _graph(plan: Plan) -> Iterator[str]:
    swarm = plan.swarm
    graph, depths = swarm.topology, swarm.topology.depths()
    yield f"swarm {swarm.name}: {len(swarm.followers)} followers, {_leaders(swarm)}, law {swarm.control.law}"
    yield from _carried(swarm)
    yield ""
    yield "who receives from whom (weight)             hops from a leader"
    for i in swarm.followers:
        neighbours = ", ".join(f"{plan.pilot[j]} ({weight:g})" for j, weight in graph.neighbours(i).items())
        yield f"  {uav(i):<7} from {neighbours:<37} {depths.get(i, '-')}"


def _carried(swarm: Swarm) -> Iterator[str]:
    for number in swarm.carried:
        yield f"  {uav(number)} is the tracker's body {swarm.body(number)!r}: a person carries it. It never flies,"
    if not swarm.carried:
        return
    height = swarm.drone(swarm.carried[0]).start[2]
    yield "  receives no orders, and no drone waits for it. The others fly around it, at the height of their places"
    yield f"  above or below it ({height:.2f} m at first). They keep {swarm.person_clearance:.2f} m from its centre"
    if swarm.walking:
        yield "  simulated: the person walks [leader.trajectory] after a start order, and stands still after any other"


def _leaders(swarm: Swarm) -> str:
    """Return who leads, in words."""
    if swarm.sole_leader is not None:
        return f"leader {swarm.reference.kind}"
    named = ", ".join(f"{uav(i)} {leader.kind}" for i, leader in swarm.leading.items())
    return f"leaders {named}" if named else "no leader"


def _law(swarm: Swarm, checked: Checked) -> Iterator[str]:
    """Yield what the law's own check predicts."""
    _, notes, rates = checked
    if notes or rates:
        yield f"law {swarm.control.law}"
    yield from (f"  predicted rate, {name}: {rate:.4g} 1/s" for name, rate in rates.items())
    yield from (f"  {note}" for note in notes)


def _lemma(swarm: Swarm) -> Iterator[str]:
    observer = swarm.observer
    if swarm.sole_leader is None:
        yield f"{_leaders(swarm)}: no settling time is proven, the law's own prediction counts; places count from no"
        yield "  leader: the fence and obstacles are not checked against them, the error is the law's own"
        return
    if swarm.control.own_law:  # it does not step (8)
        return
    result = convergence(swarm.topology, observer.gain, observer.exponent, swarm.reference.input_bound)
    bound = "none" if result.settling_time_bound == inf else f"{result.settling_time_bound:.1f} s"
    yield f"observer (8): mu = {observer.gain:g} m/s, p = {observer.exponent:g}, {observer.step} step"
    yield f"  lambda_min(Lhat) = {result.lambda_min:.5f}   theta = {result.margin:.5f} m/s   settling time <= {bound}"


def _depth(swarm: Swarm) -> Iterator[str]:
    """Yield the expected error of the deepest drone's estimate with the extended law."""
    depth_horizon = 40.0  # s of the leader's trajectory that are evaluated
    if swarm.control.law != "extended":
        return
    depths = swarm.topology.depths()
    deepest = max(swarm.followers, key=lambda i: depths[i])
    constant = swarm.observer.leader_time_constant or leader_time_constant(depths[deepest])
    age = swarm.gateway.latency + depths[deepest] * (swarm.sim.delay + 1.0 / swarm.control.rate_hz)
    period = 1.0 / swarm.gateway.rate_hz
    noise = 1e3 * swarm.gateway.noise * noise_gain(constant, age, period)
    moving = 1e3 * motion_error(course_of(swarm.reference), constant, age, period, depth_horizon)
    yield (
        f"  deepest: {uav(deepest)}, {depths[deepest]} hops, data up to {1e3 * age:.0f} ms old; error of its estimate: "
        f"{noise:.2f} mm per axis from noise (standard deviation), {moving:.2f} mm at most from the leader's turns"
    )


def _formations(swarm: Swarm, duration: float) -> Iterator[str]:
    safe, limits = swarm.drone_spacing, swarm.limits
    fence = f"{list(limits.fence.low)} to {list(limits.fence.high)}"
    if limits.fence.polygon:
        fence += f", polygon of {len(limits.fence.polygon)} corners"
    for name in swarm.formation_names:
        kind = swarm.formation_table(name).kind
        shape = survey_of(swarm, name, duration)
        low, high = (", ".join(f"{x:.2f}" for x in corner) for corner in (shape.low, shape.high))
        yield f"formation {name or '(default)'}: {kind}"
        yield f"  fastest  {shape.max_speed:6.2f} m/s  limit {limits.speed:.2f} m/s"
        yield f"  tightest {min(shape.min_distance, shape.min_distance_leader):6.2f} m    limit {safe:.2f} m"
        yield f"  reaches  [{low}] to [{high}] m from the leader; fence {fence}"


def _airframes(plan: Plan) -> Iterator[str]:
    """Yield each drone's airframe and its own reactions: its driver must be faster."""
    swarm = plan.swarm
    for name in dict.fromkeys(swarm.drone(number).airframe for number in swarm.flying):
        row, frame = swarm.airframe_row(name), swarm.airframes[name]
        drones = ", ".join(uav(number) for number in swarm.flying if swarm.drone(number).airframe == name)
        driven = "with a driver each" if row.driver else "driven by its simulation"
        yield f"airframe {name} ({drones}): {row.kind}, lag {frame.lag:g} s, dead time {frame.dead_time:g} s, {driven}"
        yield f"  by itself: without setpoints it {_by_itself(row.without_setpoints)},"
        yield f"  without poses it {_by_itself(row.without_poses)}, without its link it {_by_itself(row.without_link)}"
    yield from _cameras(swarm)


def _cameras(swarm: Swarm) -> Iterator[str]:
    """Yield what simulated cameras measure, and whether the simulated world is perfect."""
    table, frames = swarm.gateway, [swarm.airframes[swarm.drone(number).airframe] for number in swarm.simulated]
    if table.source != "simulated" and table.twin is None:
        return
    measured = f"noise {1e3 * table.noise:g} mm, latency {1e3 * table.latency:g} ms"
    yield f"cameras: simulated, {table.rate_hz:g} Hz, {measured}, {100.0 * table.dropout:g} % of the samples lost"
    if not any((table.noise, table.latency, table.dropout, *(frame.lag or frame.dead_time for frame in frames))):
        yield "  a perfect world: no noise, no latency, no lag (`flockwire init` writes those of a laboratory)"


def _by_itself(one: ByItself) -> str:
    return one.does if one.after == inf else f"{one.does} after {one.after:g} s"


def _links(plan: Plan) -> Iterator[str]:
    yield "process       listens at            linked to"
    for identity, endpoint in plan.endpoints.items():
        links = plan.links[identity]
        links_all = len(links) == len(plan.identities) - 1
        yield f"  {identity:<11} {endpoint:<21} {'all' if links_all else ', '.join(links)}"
    if plan.reserved:
        ports = [port_of(endpoint) for endpoint in plan.reserved.values()]
        yield f"  operators dial ports of their own: {min(ports)} to {max(ports)}"


def warnings(swarm: Swarm) -> Iterator[str]:
    """Yield warnings of settings that are allowed but unlikely to fly well."""
    yield from _observer_warnings(swarm)
    yield from _wind_warnings(swarm)
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


def _sight_warnings(swarm: Swarm) -> Iterator[str]:
    """Yield a warning if the safety filter limits the speed below what formation and leader need, with the remedy."""
    for name, number in _kinds(swarm):
        guard, needed = guard_parameters(swarm, number), survey_of(swarm).max_speed + leader_speed(swarm)
        if guard.fastest < min(needed, guard.speed):
            braking = 2.0 * needed * guard.delay + needed * needed / guard.acceleration
            radius = guard.separation.drone + max(braking, 2.0 * needed * guard.unheard)
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

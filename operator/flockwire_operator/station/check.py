"""`flockwire check`: the description of a swarm before it flies."""

from __future__ import annotations

import os
from collections.abc import Iterator
from math import inf

# One thread: the threads of numpy's library wait for each other in busy loops. If other processes use the cores, an
# eigenvalue of 1000 drones takes twelve seconds instead of one. It is read at numpy's import.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from flockwire_core.control.convergence import convergence
from flockwire_core.control.leader_track import motion_error, noise_gain
from flockwire_core.own_law import Checked, law_check
from flockwire_core.parameters import leader_time_constant
from flockwire_core.swarm.airframes import ByItself
from flockwire_core.swarm.formation_rules import survey_of
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.trajectories import course_of
from flockwire_core.wire.plan import Plan, port_of

from flockwire_operator.station.prediction import predicted
from flockwire_operator.station.warnings import warnings


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

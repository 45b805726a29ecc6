"""`flockwire identify`: one drone flies alone under the tracker; its airframe is fitted to the response.

It starts the processes of this host that the drone needs, and replaces the drone's pilot.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
from flockwire_core import clock
from flockwire_core.objects import load_object
from flockwire_core.runtime.refusals import Refusals
from flockwire_core.runtime.reporting import status_publisher
from flockwire_core.runtime.shell import Shell
from flockwire_core.runtime.swarm_clock import SwarmClock
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.plan import Plan
from matplotlib.figure import Figure

from flockwire_operator.station.excitation import Axis, ExcitationCore, ExcitationStage
from flockwire_operator.station.host import Host
from flockwire_operator.station.identification import AxisFit, StepResponse, combined, fit_axis
from flockwire_operator.station.processes import Children, UnansweredError, started
from flockwire_operator.station.terminal.interrupts import Interrupts, interrupts

UNTIMED = "the gateway's time is not known: check the gateway and the link to it"
UNITS = {Axis.CLOCKWISE: "rad"}
Fits = dict[Axis, AxisFit]


async def excite(
    plan: Plan, swarm_file: Path, keys: Path, number: int, out: Path, axes: Iterable[Axis] = Axis
) -> ExcitationCore:
    """Fly drone `number` along `axes` and return the measurements; raises PortInUseError, CredentialsError."""
    pilot = plan.pilots[number]
    concerned = [i for i in plan.processes_on(plan.hosts[pilot]) if plan.members[i].drone in (None, number)]
    needed = [i for i in concerned if not (plan.rows[i].pilot or plan.rows[i].records)]
    host = Host(plan, swarm_file, plan.hosts[pilot], out, keys)
    with interrupts() as interrupted:
        try:
            async with started(host, needed, pilot, interrupted) as (children, session):
                swarm_clock = SwarmClock(plan, pilot, session)
                core = await begun(swarm_clock, plan.swarm, number, axes, lambda: interrupted.count or children.died())
                if not swarm_clock.known():
                    core.failure = children.died() or UNTIMED
                    return core
                status = status_publisher(session, Refusals(pilot), swarm_clock.timekeeping)
                shell = Shell(core, session, swarm_clock, status)
                shell.start()
                await _watch(core, uav(number), children, interrupted)
                shell.stop()
        except UnansweredError as error:
            core = ExcitationCore(plan.swarm, number, clock.now(), axes)
            core.failure = str(error)
    return core


async def _watch(core: ExcitationCore, name: str, children: Children, interrupted: Interrupts) -> None:
    """Print the stages of the drone `name` until the last or a second interrupt; a first one, or a death, lands it."""
    poll = 0.1  # s
    told = ""
    while core.stage is not ExcitationStage.DONE and interrupted.count <= 1:
        await asyncio.sleep(poll)
        report = core.report(clock.now())
        if (state := f"{report.phase}: {report.detail}") != told:
            told = state
            print(f"flockwire: {name}: {told}", flush=True)
        if interrupted.count or children.died():
            core.failure = core.failure or children.died()
            core.retire(clock.now())


async def begun(
    swarm_clock: SwarmClock, swarm: Swarm, number: int, axes: Iterable[Axis], hopeless: Callable[[], object]
) -> ExcitationCore:
    """Return the core that flies drone `number` of `swarm`, started when swarm time is known.

    It waits for 10 s at most, and stops if it is `hopeless`.
    """
    ended = asyncio.Event()
    await swarm_clock.wait_for_time(ended, 10.0, lambda: ended.set() if hopeless() else None)
    return ExcitationCore(swarm, number, clock.now(), axes)


def fits(core: ExcitationCore) -> Fits:
    """Return the fit of each measured axis. Raises IdentificationError."""
    return {axis: fit_axis(response) for axis, response in core.responses.items()}


def described(found: Fits) -> Iterator[str]:
    """Yield the table of the fits with their intervals."""
    yield f"{'axis':<10} {'gain':<24} {'lag, s':<24} {'dead time, s':<24} residual"
    for axis, fit in found.items():
        numbers = "".join(
            f" {x.value:6.3f} [{x.low:6.3f}, {x.high:6.3f}]  " for x in (fit.gain, fit.lag, fit.dead_time)
        )
        yield f"{axis:<10}{numbers} {1e3 * fit.residual:.1f} m{UNITS.get(axis, 'm')}"
    yield "(with 95 % confidence; gain: flown over commanded velocity)"


def airframe_table(swarm: Swarm, number: int, found: Fits) -> Iterator[str]:
    """Yield the table for the swarm file."""
    name, airframe = swarm.drone(number).airframe, swarm.airframe(number)
    straight = [fit for axis, fit in found.items() if axis is not Axis.CLOCKWISE]
    yield f"[airframes.{name}]"
    yield f'kind = "{airframe.kind}"'
    yield f"lag = {combined([fit.lag for fit in straight]):.3f}  # s"
    yield f"dead_time = {combined([fit.dead_time for fit in straight]):.3f}  # s"
    if identified := swarm.row(number).identified:
        yield from load_object(identified)(airframe, {axis: fit.gain.value for axis, fit in found.items()})
    else:
        yield f"gain = {combined([fit.gain for fit in straight]):.3f}"


def draw(responses: dict[Axis, StepResponse], found: Fits, path: Path) -> None:
    """Draw the measured and the fitted response of each axis."""
    figure = Figure(figsize=(7.0, 1.8 * len(found)), layout="constrained")
    for place, (axis, fit) in enumerate(found.items()):
        axes = figure.add_subplot(len(found), 1, place + 1)
        times, track = np.asarray(responses[axis].track).T
        axes.plot(times - times[0], track, ".", markersize=2, color="#69707d", label="measured")
        axes.plot(times - times[0], fit.position(responses[axis].changes, times), color="#0072b2", label="fitted")
        axes.set_ylabel(f"{axis}, {UNITS.get(axis, 'm')}")
    axes.set_xlabel("s")
    figure.axes[0].legend(loc="upper right", fontsize="small")
    figure.savefig(path, dpi=160)

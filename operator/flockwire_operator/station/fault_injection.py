"""Injects faults in a real flight: signals to processes of this host, relays on their links."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice

from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.model import uav
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.kinds import Cut, Fault, Freeze, Kill, LinkChange, LinkFault, Partition, Restart
from flockwire_lab.faults.targets import AIRFRAMES, FOLLOWERS
from flockwire_lab.relay import links
from flockwire_lab.relay.links import Relays

from flockwire_operator.station.host import Host
from flockwire_operator.station.processes import Children

Injected = Kill | Restart | Freeze | LinkFault  # by the station; the others wrap the cores of processes


def unable(plan: Plan, host: str, key: str, fault: Fault) -> list[str]:
    """Return a line about each value of a fault that `up` on `host` cannot inject."""
    if fault.sim_only:
        return [f"{key}.kind = {fault.kind!r}: only `flockwire sim` can do this; a real flight cannot"]
    found = list(links.refusals(key, fault, plan, host)) if isinstance(fault, LinkFault) else []
    return found or list(islice(_refusals(key, fault, plan, host), 1))


def _refusals(key: str, fault: Fault, plan: Plan, host: str) -> Iterator[str]:
    """Yield why no process can inject `fault` into its airframes, and why only another host can inject it."""
    if fault.cores == AIRFRAMES:
        yield from _real(key, fault, plan.swarm.simulated)
    named, processes = _processes(key, fault, plan)
    far = next((identity for identity in processes if plan.hosts[identity] != host), None)
    if far is not None:
        yield f"{named}: {far} runs on host {plan.hosts[far]!r}, this is {host!r}; only its own host can do this"
    if isinstance(fault, Injected) and not plan.conducts(host):
        conductor = next(name for name in plan.swarm.hosts if plan.conducts(name))
        yield f"{named}: only {conductor!r}, the recorder's host, knows the time; use --faults there, this is {host!r}"


def _real(key: str, fault: Fault, simulated: tuple[int, ...]) -> Iterator[str]:
    for name, drone in fault.named_drones().items():
        if drone not in simulated:
            yield f"{key}.{name} = {drone}: {uav(drone)} is a real drone; must be a simulated one"
    if not simulated:
        yield f"{key}.kind = {fault.kind!r}: the swarm has no simulated drone"


def _processes(key: str, fault: Fault, plan: Plan) -> tuple[str, list[str]]:
    """Return what to name of a fault, and the processes that inject it or suffer it."""
    if isinstance(fault, Kill | Restart | Freeze):
        return f"{key}.process = {fault.process!r}", [fault.process]
    if fault.cores == FOLLOWERS:
        [(name, drone)] = fault.named_drones().items()
        return f"{key}.{name} = {drone}", [plan.pilots[drone]]
    return f"{key}.kind = {fault.kind!r}", [one for one in plan.started if plan.rows[one] in fault.cores]


class FaultInjector:
    """Injects those of the `faults` that concern links, and processes: the `children`, or the file is refused.

    Times count from the take-off order.
    """

    def __init__(self, faults: tuple[Fault, ...], host: Host, children: Children, relays: Relays) -> None:
        self._faults = faults
        self._due = [fault for fault in faults if isinstance(fault, Injected)]
        self._ends: list[tuple[float, Callable[[], None]]] = []
        self._rows, self._children, self._relays = host.plan.rows, children, relays
        self._restarting: list[str] = []  # killed processes that start again when they have ended

    def step(self, since_takeoff: int) -> None:
        """Inject the faults due `since_takeoff` ns after the take-off order."""
        t = since_takeoff / SECOND
        while self._due and self._due[0].at <= t:
            self._inject(self._due.pop(0))
        for end in [end for end in self._ends if end[0] <= t]:
            self._ends.remove(end)
            end[1]()
        for identity in [identity for identity in self._restarting if not self._children.runs(identity)]:
            self._restarting.remove(identity)
            self._children.start(identity)

    def _inject(self, fault: Injected) -> None:
        match fault:
            case Kill() if self._rows[fault.process].restarts:
                self._children.signal(fault.process, signal.SIGKILL)  # the station detects its death and restarts it
            case Kill():
                self._children.kill(fault.process)
            case Freeze():
                self._children.signal(fault.process, signal.SIGSTOP)
                if not fault.outlasted(self._faults):
                    thaw = partial(self._children.signal, fault.process, signal.SIGCONT)
                    self._ends.append((fault.at + fault.duration, thaw))
            case Restart():
                self._children.kill(fault.process)
                self._restarting.append(fault.process)
            case Cut() | LinkChange() | Partition():
                self._ends.append((fault.at + fault.duration, self._relays.inject(fault)))

"""`flockwire up`: all processes of this host, watched; a flight from take-off to landing; its report.

The recorder's host conducts the flight; other hosts serve until they must end. If this station is gone, pilots land,
and their processes end when the drones are down.
"""

from __future__ import annotations

from flockwire_lab.faults.kinds import Fault
from flockwire_lab.relay.links import Relays

from flockwire_operator.station.conduct import serve
from flockwire_operator.station.fault_injection import FaultInjector
from flockwire_operator.station.host import Host
from flockwire_operator.station.processes import UnansweredError, running
from flockwire_operator.station.terminal.interrupts import interrupts


async def fly(
    host: Host, duration: float, headless: bool, faults: tuple[Fault, ...] = (), without: tuple[int, ...] = ()
) -> str:
    """Fly `duration` s without the drones `without`; returns why the flight failed, empty if it did not.

    Raises PortInUseError and OtherFlightError before any process starts.
    """
    with interrupts() as interrupted:
        try:
            async with (
                Relays(faults if host.conducts else (), host.plan) as relays,
                running(host, interrupted, relays.environments) as (children, operator),
            ):
                if host.conducts:
                    operator.conduct(duration, without)
                injector = FaultInjector(faults, host, children, relays)
                return await serve(host, children, operator, injector, interrupted, headless)
        except UnansweredError as error:
            return str(error)

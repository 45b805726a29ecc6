"""The processes of one host while they run: alone with its keys, the router first, each after those it waits for."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager

from flockwire.wire.processes import OPERATOR

from flockwire_station.connecting import UNANSWERED, connected
from flockwire_station.flown import flown, flown_by
from flockwire_station.host import Host, alone
from flockwire_station.operator import Operator
from flockwire_station.processes import Children, start_processes
from flockwire_station.terminal.interrupts import Interrupts


class UnansweredError(RuntimeError):
    """The router did not answer; the text is what died, or that it was interrupted."""


@asynccontextmanager
async def running(
    host: Host, interrupted: Interrupts, environments: Mapping[str, Mapping[str, str]] | None = None
) -> AsyncIterator[tuple[Children, Operator]]:
    """Run the processes of `host`, and the operator who sees them; they end with the context.

    `environments` are those of Children. Raises PortInUseError and OtherFlightError before any process starts,
    UnansweredError, CredentialsError.
    """
    with alone(host), flown(host.swarm_file, flown_by(host.plan.swarm, host.swarm_file, host.keys)):
        children = Children(host, environments)
        try:
            for router in host.plan.routers:
                if router in host.processes:
                    children.start(router)
            session = await connected(host.plan, OPERATOR.kind, host.keys, interrupted, hopeless=children.died)
            if session is None:
                raise UnansweredError(children.died() or UNANSWERED)
            with session:
                operator = Operator(host.plan, session)
                await start_processes(host, children, operator, interrupted)
                yield children, operator
        finally:
            await children.end(interrupted)

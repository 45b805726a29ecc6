"""The links that a flight's faults cut or slow, their relays, and the injection of these faults."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Self

from flockwire_core.runtime.job import detour_environment
from flockwire_core.wire.plan import Plan

from flockwire_lab.faults.kinds import Fault, LinkChange, LinkFault
from flockwire_lab.network import Conditions
from flockwire_lab.relay.relay import Direction, Relay

Undo = Callable[[], None]


def refusals(key: str, fault: LinkFault, plan: Plan, host: str) -> Iterator[str]:
    """Yield why a flight on `host` cannot have `fault`, which stands at `key` of its file."""
    if plan.routers:
        yield f"{key}.kind = {fault.kind!r}: all links go to the router; a real flight needs network.mode = 'peers'"
        return
    if plan.swarm.network.link == "quic" and plan.swarm.network.security != "none":
        yield f"{key}.kind = {fault.kind!r}: links are QUIC; a real flight needs network.link = 'tls'"
        return
    if isinstance(fault, LinkChange):
        for name, share in (("loss", fault.loss), ("reordering", fault.reordering)):
            if share:
                yield (
                    f"{key}.{name} = {share:g}: must be 0 in a real flight, whose links are TCP: bytes come late, but "
                    "all and in order"
                )
    for source, target in fault.directions(plan):
        dialler, listener = _ends(source, target, plan)
        if plan.hosts[dialler] != host:
            yield (
                f"{key}.kind = {fault.kind!r}: {dialler}, which dials {listener}, must run on this host, {host!r}, "
                "in a real flight"
            )
            return


class Relays:
    """The relays that `faults` need; an asynchronous context, within which they run."""

    def __init__(self, faults: tuple[Fault, ...], plan: Plan) -> None:
        self.detours: dict[str, dict[str, str]] = {}  # by dialler, then listener
        self._plan = plan
        self._relays: dict[tuple[str, str], Relay] = {}
        self._directions: dict[tuple[str, str], Direction] = {}
        for fault in faults:
            for source, target in fault.directions(plan):
                dialler, listener = _ends(source, target, plan)
                if (dialler, listener) not in self._relays:
                    address, _, port = plan.endpoints[listener].rpartition(":")
                    relay = Relay(dialler, listener, (address.strip("[]"), int(port)))
                    self._relays[dialler, listener] = relay
                    self._directions[dialler, listener], self._directions[listener, dialler] = relay.there, relay.back

    async def __aenter__(self) -> Self:
        for (dialler, listener), relay in self._relays.items():
            self.detours.setdefault(dialler, {})[listener] = await relay.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        for relay in self._relays.values():
            relay.end()

    @property
    def environments(self) -> dict[str, dict[str, str]]:
        """The environment variables by which a process dials relays instead of its peers, by identity."""
        return {dialler: detour_environment(listeners) for dialler, listeners in self.detours.items()}

    def inject(self, fault: LinkFault) -> Undo:
        """Inject `fault`; returns a function that ends it."""
        by = Conditions(fault.delay, fault.jitter) if isinstance(fault, LinkChange) else None
        changed = [self._directions[ends] for ends in fault.directions(self._plan)]
        for direction in changed:
            direction.disturb(by)

        def undo() -> None:
            for direction in changed:
                direction.restore(by)

        return undo


def _ends(one: str, other: str, plan: Plan) -> tuple[str, str]:
    """Return the two ends of a link, the dialling one first."""
    return (one, other) if other in plan.dials[one] else (other, one)

"""The plan of a swarm: publishers, subscribers, links, dialling and addresses, from the two tables and the graph.

Session, access control, certificates, child processes, the virtual world and the probe use a Plan, not the tables.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from math import ceil
from typing import NamedTuple

from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.batch import FULL
from flockwire_core.wire.keys import BATCH, ROWS, TABLE, Delivery, Key, key_text
from flockwire_core.wire.processes import DRONE_PORTS, SINGLE_PORTS, Link, Process, Roster

AUTHORITY = "ca"  # signs the certificates of processes
OPERATORS = "operators"  # signs those of operators


def port_of(endpoint: str) -> int:
    """Return the port of HOST:PORT."""
    return int(endpoint.rpartition(":")[2])


class Flow(NamedTuple):
    """One key with the identities that publish it and those that subscribe to it."""

    key: Key
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]


class Plan(Roster):
    """The plan of `swarm`. Mappings are by identity; identities are in the order of the process table.

    `by_name`: each process has its own host of its name (a container), and is dialled by that name.
    """

    def __init__(self, swarm: Swarm, by_name: bool = False) -> None:
        super().__init__(swarm)
        self.by_name = by_name
        self.over_quic = swarm.network.security != "none" and swarm.network.link == "quic"  # it listens at UDP ports
        self.identities = tuple(self.rows)
        self._order = {identity: rank for rank, identity in enumerate(self.identities)}
        self.started = self._of_rows(lambda row: row.started)
        self.pilots: Mapping[int, str] = {i: self.pilot[i] for i in swarm.flying}  # those that a flight waits for
        self.routers = self._of_rows(lambda row: row.link is Link.ROUTER)
        self.recorders = self._of_rows(lambda row: row.records)
        self.operators = self._of_rows(lambda row: row.link is Link.DIALS)
        self.flows = tuple(self._all_flows())  # in the key table's order
        self._flows = {flow.key: flow for flow in self.flows}
        self.keys = tuple(self._flows)
        recorders, optional = set(self.recorders), set(self._of_rows(lambda row: row.optional))
        # Keys that reach the recorders in batches of their publisher, and those without which no flight can be judged.
        self.batched = self._of_flows(lambda flow: not recorders.issubset(flow.subscribers))
        self.judged = self._of_flows(lambda flow: not optional.issuperset(flow.publishers))
        operators = set(self.operators)
        self.from_operators = self._of_flows(lambda flow: not operators.isdisjoint(flow.publishers))
        self.to_operators = self._of_flows(lambda flow: not operators.isdisjoint(flow.subscribers))
        self._collect()
        self.links = self._links()
        order = self._order
        self.dials = {one: tuple(x for x in linked if order[x] < order[one]) for one, linked in self.links.items()}
        self.hosts = {identity: self.host(identity) for identity in self.identities}
        listening = self.routers or self._of_rows(lambda row: row.link is Link.PEER)
        self.endpoints = {identity: self._endpoint(identity) for identity in listening}
        self.reserved = {identity: self._reserved(identity) for identity in self.endpoints if self._reserves(identity)}
        self.authorities = (AUTHORITY, OPERATORS) if self.reserved else (AUTHORITY,)  # that sign the certificates

    def subscribers(self, key: Key) -> tuple[str, ...]:
        """Return the identities that subscribe to `key`."""
        return self._flows[key].subscribers

    def text(self, key: Key) -> str:
        """Return the key on the wire."""
        return key_text(self.swarm.name, key)

    def rate(self, key: Key) -> int:
        """Return the quota of `key`, messages per s: its row's, and for batches also twice what fills them.

            2 f sum_k s_k / F

        f is the cameras' rate, the highest in the swarm, s_k the largest message of a key in them, F a full batch.
        """
        rate = ROWS[key.kind].rate
        if key.kind == BATCH:
            largest = sum(ROWS[one.kind].largest for one in self.publishes[key.owner] if one in self.batched)
            rate += ceil(2 * self.swarm.gateway.rate_hz * largest / FULL)
        return rate

    def processes_on(self, host: str) -> tuple[str, ...]:
        """Return the identities that host `host` runs."""
        return tuple(identity for identity in self.started if self.hosts[identity] == host)

    def conducts(self, host: str) -> bool:
        """Return whether host `host` gives the orders and gets the trace."""
        return any(self.hosts[identity] == host for identity in self.recorders)

    def passes(self, sender: str, receiver: str) -> tuple[Key, ...]:
        """Return the keys that may go over the link from `sender` to `receiver`.

        Between partners these are keys that one publishes and the other subscribes to. A router passes others' keys on.
        """
        if sender in self.routers:
            return self.subscribes[receiver]
        if receiver in self.routers:
            return tuple(key for key in self.publishes[sender] if self.subscribers(key))
        return self.between(sender, receiver)

    def between(self, sender: str, receiver: str) -> tuple[Key, ...]:
        """Return the keys that `sender` publishes and `receiver` subscribes to, computed on demand."""
        sent, received = self.publishes.get(sender, ()), self.subscribes.get(receiver, ())
        if len(sent) <= len(received):
            return tuple(key for key in sent if receiver in self._flows[key].subscribers)
        return tuple(key for key in received if sender in self._flows[key].publishers)

    def dialled(self, one: str, other: str) -> str:
        """Return the endpoint at which `one` dials `other`; for an operator the one reserved for operators."""
        return self.reserved.get(other, self.endpoints[other]) if one in self.operators else self.endpoints[other]

    def locator(self, endpoint: str) -> str:
        """Return Zenoh's locator of `endpoint`; QUIC carries best-effort messages as datagrams.

        An IPv6 address has no brackets, because Zenoh searches the dialled text in the certificate.
        """
        if self.swarm.network.security == "none":
            return f"tcp/{endpoint}"
        endpoint = endpoint.replace("[", "").replace("]", "")
        return f"quic/{endpoint}?mixed_rel=1" if self.over_quic else f"tls/{endpoint}"

    def bound(self, endpoint: str) -> str:
        """Return the address at which the owner of `endpoint` listens: all addresses for a host called by name."""
        return f"0.0.0.0:{port_of(endpoint)}" if self.by_name else endpoint

    def issuer(self, identity: str) -> str:
        """Return the authority of the certificate of `identity`; operators have a separate one."""
        return OPERATORS if self.reserved and identity in self.operators else AUTHORITY

    def _of_rows(self, has: Callable[[Process], bool]) -> tuple[str, ...]:
        """Return the identities whose kind `has` something."""
        return tuple(identity for identity, row in self.rows.items() if has(row))

    def _of_flows(self, has: Callable[[Flow], bool]) -> frozenset[Key]:
        return frozenset(flow.key for flow in self.flows if has(flow))

    def _all_flows(self) -> Iterator[Flow]:
        for row in TABLE:
            for owner in row.owners(self):
                publishers, subscribers = row.publishers(self, owner), row.subscribers(self, owner)
                direct = row.delivery is not Delivery.STATE or not all(self.rows[one].batches for one in publishers)
                recorders = self.recorders if direct else ()
                yield Flow(Key(row.kind, owner.identity), publishers, (*subscribers, *recorders))

    def _collect(self) -> None:
        """Find the keys of each identity, and its partners, with which it exchanges a key, in the order of dialling."""
        publishes: dict[str, list[Key]] = {identity: [] for identity in self.identities}
        subscribes: dict[str, list[Key]] = {identity: [] for identity in self.identities}
        partners: dict[str, set[str]] = {identity: set() for identity in self.identities}
        for key, publishers, subscribers in self.flows:
            for sender in publishers:
                publishes[sender].append(key)
                partners[sender].update(subscribers)
            for receiver in subscribers:
                subscribes[receiver].append(key)
                partners[receiver].update(publishers)
        self.publishes = {identity: tuple(keys) for identity, keys in publishes.items()}
        self.subscribes = {identity: tuple(keys) for identity, keys in subscribes.items()}
        self.partners = {
            one: tuple(sorted(others - {one}, key=self._order.__getitem__)) for one, others in partners.items()
        }

    def _links(self) -> dict[str, tuple[str, ...]]:
        """Return the identities to which each is linked: its partners, or the router, which is linked to all."""
        if not self.routers:
            return self.partners
        others = tuple(identity for identity in self.identities if identity not in self.routers)
        return {identity: others if identity in self.routers else self.routers for identity in self.identities}

    def _endpoint(self, identity: str) -> str:
        """Return `IP:PORT` or `NAME:PORT`, its own: the ports of a kind do not depend on what other kinds there are."""
        swarm, row, drone = self.swarm, self.rows[identity], self.members[identity].drone
        if self.by_name:
            return f"{identity}:{swarm.network.base_port + self._place(identity)}"
        if row.pilot and drone is not None and drone in swarm.tracked:
            address = swarm.drone(drone).address
            if address is not None:
                return address
        address, port = swarm.hosts[self.hosts[identity]].address, swarm.network.base_port + self._place(identity)
        return f"[{address}]:{port}" if ":" in address else f"{address}:{port}"

    def _reserves(self, identity: str) -> bool:
        """Return whether it has a separate endpoint for operators."""
        linked = set(self.operators).intersection(self.links[identity])
        return bool(linked) and not self.routers and self.swarm.network.security == "mtls"

    def _reserved(self, identity: str) -> str:
        """Return `IP:PORT` for operators: the port is as far below the base port as its other place is above it."""
        address = self.endpoints[identity].rpartition(":")[0]
        return f"{address}:{self.swarm.network.base_port - 1 - self._place(identity)}"

    def _place(self, identity: str) -> int:
        row, drone = self.rows[identity], self.members[identity].drone
        return row.port if drone is None else SINGLE_PORTS + DRONE_PORTS * drone + row.port

"""A node in the ROS graph: a Zenoh session of its own, without any right in the swarm.

It is a client of rmw_zenoh's router, or that router itself.
"""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from typing import NamedTuple

import zenoh
import zenoh.ext

from flockwire_core.ros.graph import DEFAULT, TOKENS, End, EndKind, Node, Qos, data_key, is_node, publisher_id, read_end
from flockwire_core.ros.messages import TRIGGER
from flockwire_core.runtime.configuration import BURST, LARGEST_MESSAGE, basic_configuration
from flockwire_core.runtime.linger import ignore_linger
from flockwire_core.runtime.ros_ends import RosInput, RosOutput, RosServices

PAUSE = 1.0  # s between two attempts
MOST_ENDS = 4096  # ends of other nodes that are kept


class RosRouterAbsentError(OSError):
    """The router of the ROS graph does not answer, or (as the router) its address cannot be used."""


class Place(NamedTuple):
    """The place of a node: the router's address IP:PORT, whether it is the router itself, its domain and its name."""

    router: str
    serves: bool
    domain: int
    namespace: str  # with its leading slash
    name: str


class RosNode(AbstractContextManager["RosNode"]):
    """One node in the ROS graph. Use it as a context manager: an open session blocks the exit.

    `counts` counts what was dropped.
    """

    def __init__(self, place: Place) -> None:
        """Open its session; raises RosRouterAbsentError."""
        ignore_linger()
        self.counts: Counter[str] = Counter()
        self.place = place
        try:
            self._session = zenoh.open(zenoh.Config.from_json5(json.dumps(configuration(place))))
        except zenoh.ZError as error:
            raise RosRouterAbsentError(str(error).split(" at ", maxsplit=1)[0]) from None
        self._node = Node(place.domain, str(self._session.info.zid()), 0, place.namespace, place.name)
        self._ends, self._others = 0, dict[str, End]()
        self._declared: list[object] = []  # a declaration ends with its object
        self._token(self._node.token)

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the session; an open one blocks the process's exit."""
        self._session.close()  # type: ignore[no-untyped-call]

    @property
    def linked(self) -> bool:
        """Whether the router is there (as the router: True)."""
        return self.place.serves or bool(self._session.info.routers_zid())

    def publisher(self, name: str, ros_type: str, qos: Qos = DEFAULT) -> RosOutput:
        """Return the output of the topic of the absolute name `name`."""
        token, key = self._end(EndKind.PUBLISHER, name, ros_type, qos), data_key(self.place.domain, name, ros_type)
        reliability = zenoh.Reliability.RELIABLE if qos.reliable else zenoh.Reliability.BEST_EFFORT
        publisher: zenoh.Publisher | zenoh.ext.AdvancedPublisher
        if qos.latched:
            publisher = zenoh.ext.declare_advanced_publisher(
                self._session,
                key,
                cache=zenoh.ext.CacheConfig(max_samples=qos.depth),
                publisher_detection=True,
                sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5),  # s
                congestion_control=zenoh.CongestionControl.DROP,
            )
        else:
            publisher = self._session.declare_publisher(
                key, congestion_control=zenoh.CongestionControl.DROP, reliability=reliability
            )
        self._declared.append(publisher)
        return RosOutput(publisher, publisher_id(token))

    def subscribe(
        self, name: str, ros_type: str, shown: bool = True, wake: Callable[[], None] | None = None
    ) -> RosInput:
        """Subscribe to the topic of the absolute name `name`, in which `*` is any part; call it in the loop.

        Others see the subscription if it is `shown`.
        """
        if shown:
            self.show(name, ros_type)
        source = RosInput(self.counts, wake)
        callback = zenoh.handlers.Callback(source.arrived, indirect=False)
        key = data_key(self.place.domain, name, ros_type)
        self._declared.append(self._session.declare_subscriber(key, callback, allowed_origin=zenoh.Locality.REMOTE))
        return source

    def show(self, name: str, ros_type: str) -> None:
        """Show others a subscription to the topic of the absolute name `name`."""
        self._end(EndKind.SUBSCRIPTION, name, ros_type, DEFAULT)

    def serve(self, names: tuple[str, ...]) -> RosServices:
        """Serve a std_srvs/Trigger at each of these absolute names."""
        services = RosServices(names, self.counts)
        for name in names:
            self._end(EndKind.SERVER, name, TRIGGER, DEFAULT)
            key = data_key(self.place.domain, name, TRIGGER)
            callback = zenoh.handlers.Callback(partial(services.arrived, name, key), indirect=False)
            self._declared.append(self._session.declare_queryable(key, callback, complete=True))
        return services

    def watch(self) -> None:
        """Begin to watch the ends of other nodes, in all domains."""
        callback = zenoh.handlers.Callback(self._seen, indirect=False)
        self._declared.append(self._session.liveliness().declare_subscriber(f"{TOKENS}/**", callback, history=True))

    def publishers(self) -> tuple[End, ...]:
        """Return the publishers of other nodes, in all domains."""
        return tuple(end for end in tuple(self._others.values()) if end.kind == EndKind.PUBLISHER)

    def _seen(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.DELETE:
            self._others.pop(token, None)
            return
        end = read_end(token)
        if end is None:
            self.counts["ROS tokens not read"] += not is_node(token)
        elif len(self._others) < MOST_ENDS:
            self._others[token] = end
        else:
            self.counts["ROS tokens too many"] += 1

    def _end(self, kind: EndKind, name: str, ros_type: str, qos: Qos) -> str:
        self._ends += 1
        token = self._node.end(self._ends, kind, name, ros_type, qos)
        self._token(token)
        return token

    def _token(self, token: str) -> None:
        self._declared.append(self._session.liveliness().declare_token(token))


async def join(place: Place, ended: asyncio.Event, absent: Callable[[str], None]) -> RosNode | None:
    """Return the node at `place` when the router answers, None if `ended` is first.

    `absent` gets the reason after a failed attempt, but once while it stays the same.
    """
    why = ""
    while not ended.is_set():
        try:
            return await asyncio.to_thread(RosNode, place)
        except RosRouterAbsentError as error:
            if str(error) != why:
                why = str(error)
                absent(why)
        try:
            await asyncio.wait_for(ended.wait(), PAUSE)
        except TimeoutError:
            continue
    return None


def configuration(place: Place) -> dict[str, object]:
    """Return the Zenoh configuration of a node: no discovery but by the router, timestamps as rmw_zenoh has them."""
    locator, serves = [f"tcp/{place.router}"], place.serves
    largest = 32 << 20 if serves else LARGEST_MESSAGE  # bytes; a router passes on messages such as images
    ends = ("router", locator, list[str]()) if serves else ("client", list[str](), locator)
    config = basic_configuration(*ends, {"data": BURST}, largest)
    config["scouting"]["gossip"]["enabled"] = serves
    return config | {"timestamping": {"enabled": True}}

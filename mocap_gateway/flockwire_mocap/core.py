"""The gateway's core: it publishes each drone's pose and nearby bodies.

It also decides which proposed orders are accepted, and repeats the order in force twice a second, unchanged, for late
joiners.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from statistics import median
from typing import NamedTuple

from flockwire_core.domain.body import Nearby
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.order_log import OrderLog
from flockwire_core.objects import load_object
from flockwire_core.process.cores import Ground, Randomness, Start, Store
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import Message, decode, encode
from flockwire_core.wire.information import sees
from flockwire_core.wire.keys import MISSION, PROPOSAL, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.processes import Roster
from flockwire_core.wire.sighting import Sighting
from flockwire_core.wire.status import APART, Report, Status

from flockwire_mocap.field_bodies import FieldBodies, Stray
from flockwire_mocap.relative_sensor import RelativeSensor
from flockwire_mocap.tracking import NO_FRAMES, Drone, Source, owner

TAKE_OFF = ("prepare", "takeoff")  # the orders that name drones which are not on the field


class SourceRow(NamedTuple):
    """One kind of source, by names "module:name": a gateway imports only its own.

    `source` makes it from a Start. `connected` is its connection, an asynchronous context of the source and of what to
    call after each arrival; empty: it has none.
    """

    source: str
    connected: str = ""


SOURCES: Mapping[str, SourceRow] = {  # by gateway.source
    "simulated": SourceRow("flockwire_twins.trackers.cameras:SimulatedSource"),
    "natnet": SourceRow("flockwire_mocap.natnet.source:NatNetSource", "flockwire_mocap.natnet.client:NatNetClient"),
    "vrpn": SourceRow("flockwire_mocap.vrpn.source:VrpnSource", "flockwire_mocap.vrpn.client:VrpnClient"),
    "qualisys": SourceRow("flockwire_mocap.qualisys:QualisysSource", "flockwire_mocap.qualisys:QualisysClient"),
    "vicon": SourceRow("flockwire_mocap.vicon:ViconSource", "flockwire_mocap.vicon:ViconClient"),
    "ros": SourceRow("flockwire_mocap.ros:RosSource", "flockwire_mocap.ros:RosClient"),
    "replay": SourceRow("flockwire_mocap.replay:ReplaySource", "flockwire_mocap.replay:loaded"),
}


class GatewayCore(Ground):
    """Poses and nearby bodies of `swarm`, as `source` tracks them, and its log of orders, kept in `store`."""

    def __init__(
        self, swarm: Swarm, source: Source, now: int = 0, store: Store | None = None, chance: Randomness | None = None
    ) -> None:
        self.source, self.kind = source, swarm.gateway.source
        self.triggers = source.triggers
        self.prompt = frozenset({MISSION, PROPOSAL})
        self.period = 1.0 / swarm.gateway.rate_hz
        self._swarm = swarm
        self._drones = {swarm.body(i): i for i in swarm.tracked}
        self._seen: dict[int, int] = {}  # when each drone was seen last, Unix ns
        self._sensing = frozenset(swarm.flying) if swarm.avoidance.sensing == "nearby" else frozenset()
        self._nearby_keys = {i: Key("nearby", uav(i)) for i in swarm.flying}
        self._pose_keys = {i: Key("pose", uav(i)) for i in swarm.tracked}
        self._seen_keys = {i: Key("seen", uav(i)) for i in swarm.followers}
        self._sensor = RelativeSensor(swarm, chance) if sees(swarm) else None
        self._field = FieldBodies(swarm)
        roster = Roster(swarm)
        self._pilots = {roster.pilot[i]: i for i in swarm.flying}
        self._strays: set[int] = set()  # the drones whose pilots report that the poses are not theirs
        # poses in the reported median
        self._latencies: deque[int] = deque(maxlen=500)  # ns
        self._store = store
        self._log = OrderLog(frozenset(self._pilots), now, _kept(store))
        self._repeat_at = 0
        self._first_frame = self._last_frame = 0  # Unix ns

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message."""
        self.source.receive(key, message, now)
        if isinstance(message, Status):
            self._take_status(message, now)
        elif isinstance(message, Mission):
            self._take_order(message, now)

    def due(self, key: Key) -> bool:
        """Return whether the message that was just received completed a frame."""
        return self.source.complete()

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Publish what was tracked; for each drone what it senses first, then its pose."""
        frame, messages = self._swarm.frame, list[tuple[Key, Message]]()
        tracked = self._tracked(now)
        seen = self._take(tracked, now)
        for drone, pose in tracked:
            if drone in self._sensing:
                bodies = self._field.near(drone, pose.position)
                messages.append((self._nearby_keys[drone], Nearby(pose.stamp, frame, bodies)))
            if drone in seen:
                messages.append((self._seen_keys[drone], seen.pop(drone)))
            messages.append((self._pose_keys[drone], pose))
        if self._log.order is not None and now >= self._repeat_at:
            self._repeat_at = now + SECOND // 2  # ns between two repetitions of the newest order
            messages.append((MISSION, self._log.order))
        return messages

    def _take(self, tracked: list[Drone], now: int) -> dict[int, Sighting]:
        """Put what was tracked on the field; return what each follower sees by its relative sensor."""
        for drone, pose in tracked:
            self._seen[drone] = pose.stamp
            self._latencies.append(now - pose.stamp)
            if drone in self._strays:  # it is on the field, whatever it is
                self._field.see_other(Stray(drone), pose.stamp, pose.position)
            else:
                self._field.see_drone(drone, pose)
        if tracked and self._sensing:
            self._field.arrange(tracked[-1][1].stamp)
        if self._sensor is None:
            return {}
        return self._sensor.see([one for one in tracked if one[0] not in self._strays])

    def report(self, now: int) -> Report:
        """Return the gateway's status: problems first, then bodies that it does not see."""
        state = self.source.state(now)
        lost = [i for i in self._swarm.tracked if now - self._seen.get(i, 0) > SECOND]
        if now - self._last_frame > SECOND:
            phase, detail = Phase.WAITING, state.trouble or NO_FRAMES
        else:
            phase = Phase.TRACKING if len(lost) < len(self._swarm.tracked) else Phase.WAITING
            detail = self._unseen(lost, now)
        latency = median(self._latencies) / SECOND if self._latencies else -1.0
        return Report(
            phase, detail, mission=self._log.order, latency=latency,
            counts=(*state.counts, *self._log.counts), order_age=self._log.age(now),
        )  # fmt: skip

    def _take_order(self, order: Mission, now: int) -> None:
        """Receive an order; the next step publishes the order in force if it is new, or its giver repeats it."""
        if self._log.take(order, now):
            self._keep()
            if order.verb in TAKE_OFF:
                self._field.forget_drones(order.without)
        if self._log.order is not None and order.version == self._log.order.version:
            self._repeat_at = now

    def _keep(self) -> None:
        """Keep the order in force for a restart, and publish it in the next step."""
        self._repeat_at = 0
        order = self._log.order
        if order is not None and self._store is not None:
            self._store.write(encode(order.shift(-order.ahead)))

    def _take_status(self, status: Status, now: int) -> None:
        """Keep a drone whose pilot uses its poses no more at its last place, as a lost body."""
        drone, report = self._pilots.get(status.identity), status.report
        if drone is None:
            return
        if self._log.learn(status.identity, report, now):
            self._keep()
        if all(reason.code != APART for reason in report.reasons):
            self._strays.discard(drone)
        elif drone not in self._strays:
            self._strays.add(drone)
            if report.position is not None:
                seen = status.stamp - nanoseconds(report.pose_age)
                self._field.see_drone(drone, Pose(seen, self._swarm.frame, report.position))

    def _unseen(self, lost: list[int], now: int) -> str:
        never = [i for i in lost if i not in self._seen]
        if never and self._field.others and now - self._first_frame > SECOND:  # names may come after bodies
            names = ", ".join(repr(self._swarm.body(i)) for i in never)
            there = ", ".join(
                sorted([repr(one) if isinstance(one, str) else f"number {one}" for one in self._field.others])
            )
            return f"the tracker has no body {names}, but {there}: rename there, or set `body` of [[drones]]"
        lines = (f"does not see {', '.join(map(uav, lost))}" if lost else "", strayed(self._strays, len(self._pilots)))
        return "; ".join(filter(None, lines))

    def _tracked(self, now: int) -> list[Drone]:
        """Return the bodies with a drone's name that the source has seen since the last call, in order of time."""
        found = list[Drone]()
        for frame in self.source.take(now):
            self._first_frame = self._first_frame or now
            self._last_frame = now
            captured = frame.captured
            for body in frame.bodies:
                if not body.tracked:
                    continue
                identity, name = body.identity, body.name
                drone = owner(self._drones, identity, name)
                if drone is not None:
                    found.append((drone, Pose(captured, self._swarm.frame, body.position, body.orientation)))
                    self._field.forget_unnamed(identity)
                else:
                    if name:
                        self._field.forget_unnamed(identity)
                    self._field.see_other(name or identity, captured, body.position)
        found.sort(key=lambda one: (one[1].stamp, one[0]))
        return found


def strayed(drones: set[int], flying: int) -> str:
    """Return what is wrong with the poses of `drones`, of so many `flying` ones; if with all, it is one event."""
    if not drones:
        return ""
    if 1 < len(drones) == flying:
        return "no pose is its drone's: was the tracker's frame defined again? Land, run `flockwire align`"
    return f"the poses of {', '.join(map(uav, sorted(drones)))} are not their own: land, examine their bodies"


def _kept(store: Store | None) -> Mission | None:
    """Return the order that an earlier process kept, None without one."""
    data = store.read() if store is not None else b""
    try:
        return decode(Mission, data) if data else None
    except MessageError:
        return None


def make_core(start: Start) -> GatewayCore:
    """Return the gateway's core, with the source that the swarm file names."""
    swarm = start.plan.swarm
    return GatewayCore(
        swarm, load_object(SOURCES[swarm.gateway.source].source)(start), start.now, start.store, start.chance
    )

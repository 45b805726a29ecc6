"""The transports that lab/bench/transport.py compares. Each carries one estimate from a process of this host to others.

A transport is a function that opens the end of one process, and yields what sends a stamp (Unix ns) from there. What
arrives goes to `receive`, on the thread on which the transport has it; the stamp that this returns is sent back.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import shutil
import socket
import subprocess
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, AbstractContextManager
from dataclasses import astuple, dataclass
from functools import partial
from getpass import getuser
from importlib.util import find_spec
from pathlib import Path

import psutil
import zenoh
from flockwire_core import clock
from flockwire_core.domain.motion import Estimate, LeaderMotion
from flockwire_core.loading import parse_swarm
from flockwire_core.runtime.configuration import configuration
from flockwire_core.runtime.samples import Prompt, Wakeup
from flockwire_core.runtime.session import Session
from flockwire_core.security.files import files_of
from flockwire_core.security.pki import make_keys
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import encode
from flockwire_core.wire.inbox import ATTACHMENT
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan

FRAME, MOTION = "world", LeaderMotion((1.0, 2.0, 3.0), (0.1, 0.2, 0.3), (0.0, 0.0, 0.0))
SIZE = len(encode(Estimate(0, FRAME, MOTION))) + ATTACHMENT.size  # bytes, of every transport's message
HOME, BROKER = "127.0.0.1", "mosquitto"
OURS, PLAIN = "flockwire", "flockwire, none"  # with mutual TLS; with network.security = "none"


@dataclass(frozen=True, slots=True)
class Place:
    """Where one process stands: `number` of `count`, which receives what process `source` sends (None: nothing).

    Process 0 sends first; `folder` has the certificates, ports from `port` on are free.
    """

    folder: Path
    port: int
    count: int
    number: int = 0
    source: int | None = None

    @property
    def targets(self) -> tuple[int, ...]:
        """Who receives what this process sends."""
        return (0,) if self.number else tuple(range(1, self.count))


Receive = Callable[[int], int | None]
Send = Callable[[int], None]
Open = Callable[[Place, Receive], AbstractAsyncContextManager[Send]]
Broker = Callable[[Place], AbstractContextManager[Callable[[], float]]]


def plan_of(place: Place, security: str = "mtls") -> Plan:
    """Return the plan of followers, one for each process; only what runs here is dialled."""
    followers = range(1, place.count + 1)
    table: dict[str, object] = {
        "name": "transport",
        "formation": {"kind": "circle", "radius": 5.0, "rate": 0.01},
        "graph": {"edges": [[0, 1], [2, 1], *([1, i] for i in followers if i > 1)]},
        "limits": {"fence": {"min": [-50.0, -50.0, -0.5], "max": [50.0, 50.0, 5.0]}},
        "drones": [{"id": i, "start": [2.0 * i, 0.0, 0.0]} for i in (0, *followers)],
        "network": {"base_port": place.port, "security": security},
    }
    plan = Plan(parse_swarm(table, "bench"))
    running = {uav(i) for i in followers}
    plan.dials = {one: tuple(other for other in others if other in running) for one, others in plan.dials.items()}
    return plan


def prepare(place: Place) -> None:
    """Make the certificates."""
    make_keys(plan_of(place), place.folder, clock.utc())


@contextlib.asynccontextmanager
async def by_flockwire(place: Place, receive: Receive, security: str) -> AsyncIterator[Send]:
    """Open a session: mutual TLS and access list by `security`, quota, age, codec; it answers where an agent steps."""

    def arrived(prompt: Prompt) -> None:
        message = prompt.message(clock.now())
        if message is not None and (answer := receive(message.stamp)) is not None:
            send(answer)

    def send(stamp: int) -> None:
        session.publish(((own, Estimate(stamp, FRAME, MOTION)),))

    own, wakeup = Key("estimate", uav(place.number + 1)), Wakeup(arrived, threading.Lock())
    with Session(plan_of(place, security), own.owner, place.folder) as session:
        if place.source is not None:
            session.prompt(Key("estimate", uav(place.source + 1)), wakeup)
        wakeup.direct = True
        yield send


@contextlib.asynccontextmanager
async def by_zenoh(place: Place, receive: Receive, in_loop: bool) -> AsyncIterator[Send]:
    """Open a bare Zenoh session with the same TLS and links; answer on Zenoh's thread, or in the loop."""
    plan, own = plan_of(place), uav(place.number + 1)
    config = configuration(plan, own, files_of(place.folder, own))
    del config["access_control"]
    loop = asyncio.get_running_loop()

    def arrived(sample: zenoh.Sample) -> None:
        stamp = stamp_in(sample.payload.to_bytes())
        if in_loop:
            loop.call_soon_threadsafe(taken, stamp)
        else:
            taken(stamp)

    def taken(stamp: int) -> None:
        if (answer := receive(stamp)) is not None:
            send(answer)

    def send(stamp: int) -> None:
        publisher.put(payload(stamp))

    session = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    try:
        publisher = session.declare_publisher(
            f"bench/{place.number}",
            priority=zenoh.Priority.DATA_HIGH,
            congestion_control=zenoh.CongestionControl.DROP,
        )
        if place.source is not None:
            session.declare_subscriber(f"bench/{place.source}", zenoh.handlers.Callback(arrived, indirect=False))
        yield send
    finally:
        session.close()  # type: ignore[no-untyped-call]


@contextlib.asynccontextmanager
async def by_udp(place: Place, receive: Receive) -> AsyncIterator[Send]:
    """Open a socket; a thread waits for datagrams."""
    ours = socket.socket(type=socket.SOCK_DGRAM)
    ours.bind((HOME, place.port + place.number))

    def send(stamp: int) -> None:
        for target in place.targets:
            ours.sendto(payload(stamp), (HOME, place.port + target))

    def listen() -> None:
        with contextlib.suppress(OSError):
            while True:
                if (answer := receive(stamp_in(ours.recv(SIZE)))) is not None:
                    send(answer)

    threading.Thread(target=listen, daemon=True).start()
    yield send
    ours.close()


@contextlib.asynccontextmanager
async def by_mqtt(place: Place, receive: Receive) -> AsyncIterator[Send]:
    """Open a client of the broker, by mutual TLS: delivered at most once."""
    import aiomqtt  # noqa: PLC0415  (not everywhere)

    files = map(str, astuple(files_of(place.folder, uav(place.number + 1))))
    tls = aiomqtt.TLSParameters(*files)

    async def listen() -> None:
        async for message in client.messages:
            if (answer := receive(stamp_in(message.payload))) is not None:
                await client.publish(str(place.number), payload(answer))

    under_way: set[asyncio.Task[None]] = set()

    def send(stamp: int) -> None:
        task = asyncio.ensure_future(client.publish(str(place.number), payload(stamp)))
        under_way.add(task)
        task.add_done_callback(under_way.discard)

    at_once = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]  # as Zenoh
    async with aiomqtt.Client(HOME, place.port, tls_params=tls, socket_options=at_once) as client:
        listening = asyncio.create_task(listen())
        if place.source is not None:
            await client.subscribe(str(place.source))
        yield send
        listening.cancel()


@contextlib.asynccontextmanager
async def by_dds(place: Place, receive: Receive) -> AsyncIterator[Send]:
    """Open a participant of CycloneDDS; a listener's thread answers."""
    import transport_dds  # noqa: PLC0415  (not everywhere)

    with transport_dds.opened(place.number, place.source, receive) as send:
        yield send


@dataclass(frozen=True, slots=True)
class Transport:
    """One transport: `lacks` names the command that installs what it needs, nothing when all is there."""

    name: str
    opened: Open
    lacks: str = ""
    broker: Broker | None = None


def transports() -> Iterator[Transport]:
    """Yield all, first flockwire and those that encrypt, then flockwire without security and those that do not."""
    install = "uv pip install --python .venv-dev -r lab/bench/requirements.txt"
    dds = "" if find_spec("cyclonedds") else install
    server = "" if broker_program() else f"apt-get install {BROKER}"
    mqtt = "; ".join(filter(None, ("" if find_spec("aiomqtt") else install, server)))
    yield Transport(OURS, partial(by_flockwire, security="mtls"))
    yield Transport("Zenoh", partial(by_zenoh, in_loop=False))
    yield Transport("Zenoh, asyncio", partial(by_zenoh, in_loop=True))
    yield Transport("MQTT, TLS", by_mqtt, mqtt, broker)
    yield Transport(PLAIN, partial(by_flockwire, security="none"))
    yield Transport("CycloneDDS", by_dds, dds)
    yield Transport("UDP", by_udp)


def broker_program() -> str | None:
    """Return the path of the MQTT broker, None when it is not installed."""
    return shutil.which(BROKER) or shutil.which(BROKER, path="/usr/sbin")


@contextlib.contextmanager
def broker(place: Place) -> Iterator[Callable[[], float]]:
    """Run the MQTT broker inside, with mutual TLS; yields the function of its processor time, s."""
    file, files = place.folder / f"broker{place.port}.conf", files_of(place.folder, "gateway")
    lines = [f"listener {place.port} {HOME}", "allow_anonymous true", "set_tcp_nodelay true"]
    lines += [f"cafile {files.authority}", f"certfile {files.certificate}", f"keyfile {files.key}"]
    lines += ["require_certificate true", f"user {getuser()}"]  # who may read the key
    file.write_text("\n".join(lines))
    with subprocess.Popen([broker_program() or BROKER, "-c", str(file)], stderr=subprocess.DEVNULL) as process:
        times = psutil.Process(process.pid).cpu_times
        try:
            yield lambda: sum(times()[:2])
        finally:
            process.terminate()


def payload(stamp: int) -> bytes:
    """Return the message of the transports that carry bytes."""
    return stamp.to_bytes(8, "little").ljust(SIZE, b"\0")


def stamp_in(message: bytes) -> int:
    """Return the stamp of a message of `payload`."""
    return int.from_bytes(message[:8], "little")

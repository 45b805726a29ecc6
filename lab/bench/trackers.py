"""Every tracker protocol over loopback: whether every frame arrives, once, with its names, and how long it takes.

    python lab/bench/trackers.py [SECONDS] [--bodies 10] [--rate 240] [--only natnet-4.1-unicast]

The server runs in a process of its own. `in` is from the packet's arrival in this process to the frame's delivery,
`all` from the server's sending to the delivery; ms, median and 99th percentile. Ends with status 1 if a frame is
missing, repeated or misnamed, or if the median of `in` exceeds 0.3 ms.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import NamedTuple

from flockwire_core import clock
from flockwire_core.loading import load_swarm
from flockwire_core.process.cores import Start
from flockwire_core.swarm.gateway import Gateway, NatNet, Vrpn
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import GATEWAY
from flockwire_mocap.natnet.client import NatNetClient
from flockwire_mocap.natnet.packets import Version
from flockwire_mocap.natnet.session import NatNetSession
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_mocap.vrpn.client import VrpnClient
from flockwire_mocap.vrpn.source import VrpnSource
from flockwire_twins.trackers.natnet import TwinOptions
from flockwire_twins.trackers.natnet_server import NatNetServer
from flockwire_twins.trackers.vrpn import VrpnServer
from streaming import stream

HOME = "127.0.0.1"
VERSIONS: tuple[Version, ...] = ((3, 0), (3, 1), (4, 0), (4, 1), (4, 2), (4, 5))
LATENCY = 0.3  # ms, the bar for the median
PATIENCE = 3.0  # s


class Case(NamedTuple):
    """A protocol; `version` is None for VRPN."""

    name: str
    version: Version | None
    multicast: bool = False


CASES = (
    *(
        Case(f"natnet-{version[0]}.{version[1]}-{'multicast' if multicast else 'unicast'}", version, multicast)
        for version in VERSIONS
        for multicast in (False, True)
    ),
    Case("vrpn", None),
)


def names(count: int) -> dict[int, str]:
    """Return the bodies' names by number."""
    return {k: f"drone {k}" for k in range(count)}


def frames(count: int, bodies: int) -> Iterator[TrackerFrame]:
    """Yield frames of bodies whose height encodes the frame's number."""
    for number in range(count):
        now = clock.now() // 1000 * 1000
        row = (
            ReportedBody(k, n, (float(k), 0.0, float(number)), (0.0, 0.0, 0.0, 1.0), True)
            for k, n in names(bodies).items()
        )
        yield TrackerFrame(number, now, now, tuple(row))


async def serve(case: Case, count: int, bodies: int, rate: float) -> None:
    """Serve: print the port, wait for a line, stream."""
    server: NatNetServer | VrpnServer
    if case.version is None:
        server = VrpnServer(names(bodies).values(), port=0)
        await server.open()
        port = server.port
    else:
        options = TwinOptions(case.version, case.multicast, data_port=0)
        server = NatNetServer(options, names(bodies), command_port=0)
        await server.open()
        port = server.command_port
    print(json.dumps(port), flush=True)
    await asyncio.to_thread(sys.stdin.readline)
    await stream(frames(count, bodies), rate, server.publish)
    await asyncio.sleep(1.0)
    server.close()


@dataclass
class Seen:
    """What was delivered: reports by body and number of frame, and how long they took, ns."""

    reports: dict[tuple[int, int], int] = field(default_factory=dict)
    misnamed: int = 0
    inside: list[int] = field(default_factory=list)
    whole: list[int] = field(default_factory=list)

    def deliver(self, frame: TrackerFrame, received: int, *_: object) -> None:
        """Receive a frame."""
        now = clock.now()
        self.inside.append(now - received)
        self.whole.append(now - frame.transmitted)
        for body in frame.bodies:
            place = (round(body.position[0]), round(body.position[2]))
            self.reports[place] = self.reports.get(place, 0) + 1
            self.misnamed += body.name != f"drone {place[0]}"


@asynccontextmanager
async def natnet(case: Case, port: int, seen: Seen, bodies: int) -> AsyncIterator[Callable[[], bool]]:
    """Connect a NatNet client; yields whether it is ready."""
    session = NatNetSession(NatNet(server=HOME, interface=HOME, command_port=port, multicast=case.multicast))
    client = NatNetClient(session, seen.deliver)
    await client.open()
    yield lambda: len(session.names) == bodies
    client.close()


@asynccontextmanager
async def vrpn(case: Case, port: int, seen: Seen, bodies: int) -> AsyncIterator[Callable[[], bool]]:
    """Connect a VRPN client; yields whether it is ready."""
    gateway = Gateway(source="vrpn", vrpn=Vrpn(server=HOME, port=port))
    plan = Plan(load_swarm(Path("examples/paper_simulation.toml")).tracked_by(gateway))
    source = VrpnSource(Start(plan, GATEWAY.kind, clock.now(), Random(0)))
    source.arrived = seen.deliver
    client = VrpnClient(source, lambda: None)
    client.open()
    yield lambda: len(source.connection.senders) == bodies
    await client.close()


async def measure(case: Case, options: argparse.Namespace) -> bool:
    """Run one case and print its row; returns whether it is up to the bar."""
    count = round(options.seconds * options.rate)
    command = [sys.executable, __file__, str(options.seconds), "--serve", case.name]
    command += ["--bodies", str(options.bodies), "--rate", str(options.rate)]
    server = await asyncio.create_subprocess_exec(*command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert server.stdin is not None
    assert server.stdout is not None
    port, seen = json.loads(await server.stdout.readline()), Seen()
    connect = vrpn if case.version is None else natnet
    async with connect(case, port, seen, options.bodies) as ready:
        async with asyncio.timeout(PATIENCE):
            while not ready():  # noqa: ASYNC110 sockets report to no event
                await asyncio.sleep(0.05)
        await asyncio.sleep(0.3)  # until the group is joined that the server has announced
        server.stdin.write(b"\n")
        await server.wait()
    return report(case, seen, count * options.bodies)


def report(case: Case, seen: Seen, expected: int) -> bool:
    """Print a row; returns whether it is up to the bar."""
    missing = expected - len(seen.reports)
    repeated = sum(seen.reports.values()) - len(seen.reports)
    values = [percentile(times, share) for times in (seen.inside, seen.whole) for share in (0.5, 0.99)]
    print(
        f"{case.name:24}{expected:9}{missing:9}{repeated:10}{seen.misnamed:10}",
        *(f"{v:9.3f}" for v in values),
        flush=True,
    )
    return not missing and not repeated and not seen.misnamed and values[0] <= LATENCY


def percentile(times: list[int], share: float) -> float:
    """Return the value, ms, that `share` of the times, ns, do not exceed."""
    ordered = sorted(times)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] / 1e6 if ordered else float("nan")


def main() -> None:
    """Measure all cases."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seconds", type=float, nargs="?", default=60.0)
    parser.add_argument("--bodies", type=int, default=10)
    parser.add_argument("--rate", type=float, default=240.0)
    parser.add_argument("--only", choices=[case.name for case in CASES])
    parser.add_argument("--serve", choices=[case.name for case in CASES], help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        case = next(case for case in CASES if case.name == options.serve)
        asyncio.run(serve(case, round(options.seconds * options.rate), options.bodies, options.rate))
        return
    heads = ("in p50", "in p99", "all p50", "all p99")
    print(f"{'protocol':24}{'reports':>9}{'missing':>9}{'repeated':>10}{'misnamed':>10}", *(f"{h:>9}" for h in heads))
    cases = [case for case in CASES if options.only in {None, case.name}]
    results = [asyncio.run(measure(case, options)) for case in cases]
    sys.exit(not all(results))


if __name__ == "__main__":
    main()

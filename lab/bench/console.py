"""What the console costs beside forty drones, and how fast a stop from its page is.

    lab/bench/console.py [--seconds 20] [--runs 40]

One process publishes for all members of separation/forty.toml, each with its own session and certificate: every
status and every telemetry ten times a second. Cost: the share of a core that the console takes with nobody looking,
with one page, with a page and a Foxglove viewer that subscribes to every topic; what counts are seconds in which all
that should be published, shown and forwarded was. Stop: from the order on the page's websocket to the telemetry that
says that the motors of all drones are off, with real airframes on the ground and all others published as before; the
way back of the telemetry is included. A row of its own has stops during which no core was taken away for over 5 ms.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import aiohttp
import psutil
from flockwire_core import clock
from flockwire_core.domain.airframe import FlightState
from flockwire_core.loading import load_swarm
from flockwire_core.runtime.session import Session
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import CONSOLE, KINEMATICS, OPERATOR
from flockwire_operator.station.host import Host
from flockwire_operator.station.operator import Operator
from published_swarm import PERIOD, publishing
from robo_ws_bridge import WebSocketBridgeClient
from taken_cores import TakenCores, taken_cores

SWARM = Path(__file__).parent / "separation/forty.toml"
BASES = range(10500, 20000, 500)  # where ports are looked for
PORTS = 200  # that the swarm, the page and Foxglove need on each side of the base port
SLICE = 2.0  # s: what counts, or does not, as one
TOLERANCE = 0.1  # by which a rate may be off in one that counts
DISTURBED = 0.005  # s for which a core is taken away from a stop that counts as disturbed
PATIENCE = 60.0  # s


class Page:
    """What a page receives: its newest picture, and the answers to its orders."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.picture: dict[str, Any] = {"drones": {}, "others": {}}
        self.pictures = 0
        self.answers: list[dict[str, Any]] = []

    async def read(self) -> None:
        """Take what comes until the socket is closed."""
        async for message in self.socket:
            content = json.loads(message.data)
            if "drones" in content:
                self.picture, self.pictures = content, self.pictures + 1
            elif "answer" in content:
                self.answers.append(content["answer"])

    def shows(self, plan: Plan, phase: str) -> bool:
        """Return whether all pilots are in `phase`."""
        drones = self.picture["drones"].values()
        return len(drones) == len(plan.pilots) and all(drone["phase"] == phase for drone in drones)

    def silent(self, identity: str) -> bool:
        """Return whether a process that flies nothing is not heard."""
        return self.pictures > 0 and self.picture["others"].get(identity, {"phase": "silent"})["phase"] == "silent"


def are_free(base: int) -> bool:
    """Return whether all ports round `base` are free."""
    with contextlib.ExitStack() as stack, contextlib.suppress(OSError):
        for port in range(base - PORTS, base + PORTS):
            stack.enter_context(socket.socket()).bind(("127.0.0.1", port))
        return True
    return False


class Bench:
    """A swarm in a folder of its own, its console, and what is published for it."""

    def __init__(self, folder: Path) -> None:
        self.file, self.keys, self.out = folder / "swarm.toml", folder / "keys", folder / "out"
        self.out.mkdir()
        base = next(filter(are_free, BASES))
        self.page, self.foxglove = base + PORTS - 1, base + PORTS - 2
        self.file.write_text(f"{SWARM.read_text()}\n[network]\nbase_port = {base}\n")
        self.plan = Plan(load_swarm(self.file))
        make_keys(self.plan, self.keys, clock.utc())
        self.host = Host(self.plan, self.file, "localhost", self.out, self.keys)

    def publishing(self, *without: str) -> AbstractContextManager[Any]:
        """Publish for everybody but those `without`."""
        return publishing(self.file, self.keys, tuple(one for one in self.plan.started if one not in without))

    @contextlib.contextmanager
    def console(self) -> Iterator[tuple[psutil.Popen, str]]:
        """Run the console; yields its process and the token of its link."""
        options = ["--port", str(self.page), "--foxglove", str(self.foxglove), "--keys", str(self.keys)]
        line = [sys.executable, "-m", "flockwire_operator", "console", str(self.file), *options]
        with psutil.Popen(line, stdout=subprocess.PIPE, text=True) as process:
            try:
                link = re.search(r"http://\S+#(\S+)", process.stdout.readline())
                assert link is not None
                yield process, link[1]
            finally:
                process.terminate()

    @contextlib.contextmanager
    def airframes(self) -> Iterator[None]:
        """Run the real process of the simulated airframes."""
        line = self.host.command_line(KINEMATICS.kind)
        with subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            try:
                yield
            finally:
                process.kill()


@contextlib.asynccontextmanager
async def page(port: int, token: str) -> AsyncIterator[Page]:
    """Open the console's page."""
    link = f"http://127.0.0.1:{port}/live?token={token}"
    async with aiohttp.ClientSession() as session, session.ws_connect(link) as socket:
        opened = Page(socket)
        reading = asyncio.create_task(opened.read())
        try:
            yield opened
        finally:
            reading.cancel()


@contextlib.asynccontextmanager
async def viewer(port: int, topics: int) -> AsyncIterator[list[int]]:
    """Subscribe to all topics as Foxglove does; yields how many messages came."""
    client, count, found = WebSocketBridgeClient(f"ws://127.0.0.1:{port}", subprotocol="foxglove.sdk.v1"), [0], []

    async def advertised(channel: Any) -> None:  # noqa: ANN401  (a dictionary of the library's)
        found.append(channel["topic"])
        await client.subscribe(channel["topic"])

    def received(*_: object) -> None:
        count[0] += 1

    client.on_advertised_channel(advertised)
    client.on_message(received)
    await client.connect()
    await until(lambda: len(found) == topics and count[0] > topics)
    try:
        yield count
    finally:
        await client.disconnect()


async def until(met: Callable[[], bool], pause: float = 0.05) -> float:
    """Wait until it is so; returns when that was seen, s of the monotonic clock."""
    deadline = time.monotonic() + PATIENCE
    while not met():
        if time.monotonic() > deadline:
            raise TimeoutError(met)
        await asyncio.sleep(pause)
    return time.monotonic()


@dataclass
class Counted:
    """A number that should grow by `rate` each s."""

    read: Callable[[], int]
    rate: float


async def share(process: psutil.Popen, seconds: float, counted: tuple[Counted, ...]) -> tuple[float, float]:
    """Return the share of a core that the process takes in `seconds` that count, and how many did not count."""
    taken, valid, lost = 0.0, 0.0, 0.0
    while valid < seconds:
        begin, before, cpu = time.monotonic(), [one.read() for one in counted], sum(process.cpu_times()[:2])
        await asyncio.sleep(SLICE)
        lasted, cpu = time.monotonic() - begin, sum(process.cpu_times()[:2]) - cpu
        rates = [(one.read() - was) / lasted / one.rate for one, was in zip(counted, before, strict=True)]
        if all(abs(rate - 1.0) < TOLERANCE for rate in rates):
            taken, valid = taken + cpu, valid + lasted
        else:
            lost += lasted
        if lost > PATIENCE + 10 * seconds:
            raise TimeoutError(f"the machine is too busy: {lost:.0f} s did not count, {valid:.0f} s did")
    return taken / valid, lost


async def costs(bench: Bench, seconds: float) -> None:
    """Print what the console costs."""
    topics = len(bench.plan.subscribes[CONSOLE.kind])
    with bench.publishing() as count, bench.console() as (process, token):
        published = Counted(lambda: count.value, topics / PERIOD)

        async def row(name: str, *counted: Counted) -> None:
            taken, lost = await share(process, seconds, (published, *counted))
            print(f"{name:20} {100 * taken:5.1f} % of a core ({lost:.0f} s did not count)", flush=True)

        async with page(bench.page, token) as opened:
            await until(lambda: opened.shows(bench.plan, "formation"))
        await row("nobody looks")
        async with page(bench.page, token) as opened:
            pictures = Counted(lambda: opened.pictures, 1.0 / PERIOD)
            await row("one page", pictures)
            async with viewer(bench.foxglove, topics) as seen:
                await row("page and Foxglove", pictures, Counted(lambda: seen[0], published.rate))
        print(f"resident             {process.memory_info().rss / 2**20:5.0f} MB", flush=True)


async def stop_once(bench: Bench, token: str, operator: Operator, cores: TakenCores) -> tuple[float, float]:
    """Return how long a stop from a page took, and for how long a core was taken away meanwhile, s."""

    def in_state(state: FlightState) -> bool:
        operator.poll()
        known = operator.telemetry.values()
        return len(known) == len(bench.plan.pilots) and all(telemetry.state is state for telemetry in known)

    operator.telemetry.clear()
    async with page(bench.page, token) as opened:
        await until(lambda: opened.silent(KINEMATICS.kind))  # the last one's airframes
        with bench.airframes():
            await until(lambda: opened.shows(bench.plan, "formation") and not opened.silent(KINEMATICS.kind))
            await until(lambda: in_state(FlightState.GROUNDED))
            cores.reset()
            began = time.monotonic()
            await opened.socket.send_json({"order": "stop"})
            taken = await until(lambda: in_state(FlightState.STOPPED), 0.0005) - began
            disturbed = cores.longest()
            await until(lambda: bool(opened.answers))
    assert opened.answers[0]["failed"] == "", opened.answers
    return taken, disturbed


def row(name: str, seconds: list[float]) -> None:
    """Print one row of the stops."""
    taken = sorted(1000.0 * second for second in seconds)
    if taken:
        p99 = taken[min(len(taken) - 1, int(0.99 * len(taken)))]
        print(f"{name:20} {len(taken):3} x   median {statistics.median(taken):.1f} ms   p99 {p99:.1f} ms", flush=True)


async def stops(bench: Bench, runs: int) -> None:
    """Print how long stops from the page took: `runs` undisturbed ones, but no more than three times as many in all."""
    found: list[tuple[float, float]] = []
    quiet: list[float] = []
    with (
        bench.publishing(KINEMATICS.kind),
        bench.console() as (_, token),
        Session(bench.plan, OPERATOR.kind, bench.keys) as session,
        taken_cores() as cores,
    ):
        operator = Operator(bench.plan, session)
        while len(quiet) < runs and len(found) < 3 * runs:
            found.append(await stop_once(bench, token, operator, cores))
            quiet = [seconds for seconds, disturbed in found if disturbed < DISTURBED]
    row("stop, all", [seconds for seconds, _ in found])
    row("stop, undisturbed", quiet)


def main() -> None:
    """Measure everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--runs", type=int, default=40)
    options = parser.parse_args()
    print(f"load of the machine before: {psutil.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder))
        asyncio.run(costs(bench, options.seconds))
        asyncio.run(stops(bench, options.runs))


if __name__ == "__main__":
    main()

"""The drivers of Tellos: command to datagram, stop to `emergency`, and ten of them side by side on one host.

    lab/bench/driver.py [--seconds 10] [--stops 20]

The bench is the pilots and the operator at one end of the real driver processes, and the Tellos at the other. Times are
from before the message is published until the datagram has come, both ends and the network between included; with them
the same messages until they reach a session of the recorder's in this process, which is how long publishing and network
take without a driver, and the core alone. Stops are given with every agent under SIGSTOP.
"""

from __future__ import annotations

import argparse
import contextlib
import select
import signal
import socket
import statistics
import subprocess
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import tomli_w
import zenoh
from flockwire_core import clock
from flockwire_core.domain.airframe import Command
from flockwire_core.ground.order import Order
from flockwire_core.loading import load_swarm
from flockwire_core.runtime.session import Session
from flockwire_core.security.files import files_of
from flockwire_core.security.pki import make_keys
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import AGENT, DRIVER, LEADING, OPERATOR
from flockwire_lab.probe.attackers import Attacker, attacker_configuration
from flockwire_operator.station.host import Host
from flockwire_operator.station.operator import Operator
from flockwire_tello.driver import DriverCore
from flockwire_tello.state_string import format_state
from flockwire_tello.swarm_file import COMMAND_PORT, tello_addresses
from flockwire_twins.tello.parameters import TelloParameters
from flockwire_twins.tello.tello import SimulatedTello

SWARM = Path(__file__).parents[2] / "examples/paper_flight.toml"
BASE_PORT = 21000
HOVER = 0.2  # m/s that the pilots command


class Bench:
    """The drivers of `count` Tellos in a folder of their own, and both ends of them."""

    def __init__(self, folder: Path, count: int) -> None:
        table: dict[str, Any] = tomllib.loads(SWARM.read_text())
        table["network"] = {"base_port": BASE_PORT}
        table["drones"] = [
            {"id": i, "airframe": "tello", "start": [0.7 * (i % 4), 0.7 * (i // 4) + 1.0, 0.0]} for i in range(count)
        ]
        table["graph"] = {"edges": [[i, i + 1] for i in range(count - 1)]}
        table["formation"] = {"kind": "circle", "radius": 1.5}
        self.file, self.keys, self.out = folder / "swarm.toml", folder / "keys", folder / "out"
        self.file.write_text(tomli_w.dumps(table))
        self.plan = Plan(load_swarm(self.file))
        make_keys(self.plan, self.keys, clock.utc())
        self.host = Host(self.plan, self.file, "localhost", self.out, self.keys)
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.tellos: dict[int, socket.socket] = {}
        self.clients: dict[int, tuple[str, int]] = {}  # who commands which
        self.rc: Counter[int] = Counter()
        self.strange: Counter[int] = Counter()  # datagrams that came to a Tello from another's driver
        self.sessions = {i: self._pilot(identity) for i, identity in self.plan.pilot.items()}
        self.session = Session(self.plan, OPERATOR.kind, self.keys)
        self.operator = Operator(self.plan, self.session)
        for i in self.plan.swarm.driven:
            self.tellos[i] = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self.tellos[i].bind((tello_addresses(self.plan.swarm, i).drone, COMMAND_PORT))
        flying = SimulatedTello(TelloParameters(), 0).state(0)._replace(h=100, tof=100)
        self.states = {i: format_state(flying._replace(bat=40 + i)) for i in self.tellos}
        self._state_at = 0.0
        self.heard_at = 0.0  # when the recorder's session had the newest command

    def _pilot(self, identity: str) -> Session:
        return Session(self.plan, identity, self.keys)

    def start(self, *kinds: str) -> None:
        """Start the processes of `kinds`."""
        for identity in (identity for kind in kinds for identity in self.plan.of_kind(kind)):
            line = self.host.command_line(identity)
            self.processes[identity] = subprocess.Popen(line, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)

    def give(self, drone: int) -> None:
        """Command a drone, as its pilot does."""
        velocity = Command(clock.now(), self.plan.swarm.frame, (0.0, 0.0, HOVER))
        self.sessions[drone].publish([(Key("command", uav(drone)), velocity)])

    def hear(self, seconds: float) -> list[tuple[float, int, bytes]]:
        """Return what comes to the Tellos within `seconds`, at the first datagram at once; answer, send states."""
        now = time.monotonic()
        if now >= self._state_at:
            self._state_at = now + 0.1
            for i, client in self.clients.items():
                self.tellos[i].sendto(self.states[i], (client[0], 8890))
        ready, _, _ = select.select(list(self.tellos.values()), [], [], max(0.0, seconds))
        found = []
        for i, tello in self.tellos.items():
            if tello not in ready:
                continue
            data, sender = tello.recvfrom(256)
            at = time.monotonic()
            found.append((at, i, data))
            self.strange[i] += self.clients.setdefault(i, sender) != sender
            if data.startswith(b"rc"):
                self.rc[i] += 1
            elif data != b"emergency":
                tello.sendto(b"20" if data == b"sdk?" else b"ok", sender)
        return found

    def until(self, end: float) -> list[tuple[float, int, bytes]]:
        """Return all that comes to the Tellos until `end`, s of the monotonic clock."""
        found = []
        while (left := end - time.monotonic()) > 0.0:
            found += self.hear(min(left, 0.01))
        return found

    def run(self, seconds: float) -> None:
        """Command all drones at 100 Hz."""
        due = time.monotonic()
        for _ in range(round(100 * seconds)):
            for i in self.tellos:
                self.give(i)
            due += 0.01
            self.until(due)

    def latencies(self, drone: int, seconds: float) -> tuple[list[float], list[float]]:
        """Return the s from a command to its datagram, of those that have one, and to the recorder's session."""
        taken, network, due = [], [], time.monotonic()
        with self._recorder(drone):
            for _ in range(round(100 * seconds)):
                began = time.monotonic()
                self.give(drone)
                due += 0.01
                taken += [at - began for at, i, data in self.until(due) if i == drone and data.startswith(b"rc")]
                network += [self.heard_at - began] if self.heard_at > began else []
        return taken, network

    @contextlib.contextmanager
    def _recorder(self, drone: int) -> Iterator[None]:
        """Receive a drone's commands with the recorder's certificate."""
        recorder, pilot = self.plan.recorders[0], self.plan.pilot[drone]
        attacker = Attacker(recorder, files_of(self.keys, recorder), "peer")
        target = self.plan.locator(self.plan.endpoints[pilot])

        def arrived(_: zenoh.Sample) -> None:
            self.heard_at = time.monotonic()

        with zenoh.open(attacker_configuration(attacker, [target], str(self.keys / "ca.crt"))) as session:
            key = self.plan.text(Key("command", uav(drone)))
            session.declare_subscriber(key, zenoh.handlers.Callback(arrived, indirect=False))
            self.run(1.0)
            yield

    def stop(self) -> float:
        """Stop; return the s until each Tello had an `emergency`, the longest of them."""
        waiting, began, last = set(self.tellos), time.monotonic(), 0.0
        self.operator.ask(Order("stop", reason="bench"))
        while waiting and time.monotonic() < began + 2.0:
            for at, i, data in self.hear(0.01):
                if data == b"emergency" and i in waiting:
                    waiting.discard(i)
                    last = at - began
        return last if not waiting else float("inf")

    def batteries(self) -> dict[int, float]:
        """Return the batteries that the drivers report: each Tello has another."""
        self.operator.poll()
        return {i: round(telemetry.battery, 2) for i, telemetry in self.operator.telemetry.items()}

    def end(self) -> None:
        """End everything."""
        for process in self.processes.values():
            process.kill()
        for process in self.processes.values():
            process.wait()
        for session in (self.session, *self.sessions.values()):
            session.close()
        for tello in self.tellos.values():
            tello.close()


def side_by_side(seconds: float) -> None:
    """Run ten drivers, measure one of them, count what each Tello receives."""
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), 10)
        try:
            bench.start(DRIVER.kind)
            deadline = time.monotonic() + 30.0
            while len(bench.batteries()) < 10 and time.monotonic() < deadline:
                bench.run(0.5)
            alone, network = bench.latencies(3, seconds)
            bench.rc.clear()
            began = time.monotonic()
            bench.run(seconds)
            lasted = time.monotonic() - began
            row("command -> datagram, processes and network", alone)
            row("command -> another session, the network alone", network)
            rates = [count / lasted for count in bench.rc.values()]
            print(f"ten drivers: rc {min(rates):.1f} to {max(rates):.1f} Hz; {sum(bench.strange.values())} datagrams "
                  f"at another's Tello; batteries {'apart' if _apart(bench.batteries()) else 'MIXED UP'}")  # fmt: skip
        finally:
            bench.end()


def _apart(batteries: dict[int, float]) -> bool:
    return batteries == {i: round((40 + i) / 100.0, 2) for i in range(10)}


def stops(count: int) -> None:
    """Stop five drivers, their agents and the leader frozen."""
    taken = []
    for _ in range(count):
        with tempfile.TemporaryDirectory() as folder:
            bench = Bench(Path(folder), 5)
            try:
                for session in bench.sessions.values():
                    session.close()
                bench.sessions.clear()
                bench.start(DRIVER.kind, AGENT.kind, LEADING.kind)
                deadline = time.monotonic() + 30.0
                while len(bench.batteries()) < 5 and time.monotonic() < deadline:
                    bench.until(time.monotonic() + 0.2)
                for identity in bench.plan.pilots.values():
                    bench.processes[identity].send_signal(signal.SIGSTOP)
                bench.until(time.monotonic() + 0.3)
                taken.append(bench.stop())
            finally:
                bench.end()
    row("stop -> emergency at the last of five, agents frozen", taken)


def core_alone(count: int) -> list[float]:
    """Return the s that a core takes from a command to its datagram."""
    swarm = load_swarm(SWARM)
    now = clock.now()
    core = DriverCore(swarm, 1, now)
    taken = []
    for k in range(count):
        now += 20_000_000
        message = Command(now, "world", (0.001 * (k % 7), 0.0, 0.1))
        began = time.perf_counter()
        core.receive(Key("command", uav(1)), message, now)
        core.outgoing(now)
        taken.append(time.perf_counter() - began)
    return taken


def row(name: str, seconds: list[float]) -> None:
    """Print one row of the table."""
    ordered = sorted(1000.0 * second for second in seconds)
    p99 = ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))]
    print(f"{name:54} {len(ordered):5} x  p50 {statistics.median(ordered):7.3f} ms  p99 {p99:7.3f} ms", flush=True)


def main() -> None:
    """Measure everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--stops", type=int, default=20)
    options = parser.parse_args()
    print(f"load of the machine before: {psutil.getloadavg()[0]:.1f}")
    row("command -> datagram, the core alone", core_alone(2000))
    side_by_side(options.seconds)
    stops(options.stops)


if __name__ == "__main__":
    main()

"""How long an emergency stop takes: from the order to the telemetry that says that the motors of all drones are off.

    .venv-dev/bin/python lab/bench/stop.py [--runs 30] [--in-flight 3]

Rows: a session that is kept, a one-shot `flockwire stop` on an idle machine and with all cores busy, to the drivers of
five drones on the ground; then a one-shot in flight, with each kind of process dead. The way back of the telemetry is
included.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import multiprocessing
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import cycle
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.order import Order
from flockwire_core.loading import load_swarm
from flockwire_core.runtime.session import Session
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR
from flockwire_operator.station.host import Host
from flockwire_operator.station.operator import Operator

SWARM = Path(__file__).parents[2] / "examples/paper_simulation.toml"
PORTS = cycle(range(20000, 32000, 80))  # below those that the kernel gives to outgoing connections
VICTIMS = ("uav2", "leader", "gateway", "recorder")


class Bench:
    """One swarm in a folder of its own, and an operator that watches it."""

    def __init__(self, folder: Path, text: str = "") -> None:
        self.file, self.keys, self.out = folder / "swarm.toml", folder / "keys", folder / "out"
        self.out.mkdir()
        self.file.write_text(f"{text or SWARM.read_text()}\n[network]\nbase_port = {next(PORTS)}\n")
        self.plan = Plan(load_swarm(self.file))
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        make_keys(self.plan, self.keys, clock.utc())
        self.host = Host(self.plan, self.file, "localhost", self.out, self.keys)
        self.session = Session(self.plan, OPERATOR.kind, self.keys)
        self.operator, self.loop = Operator(self.session), asyncio.new_event_loop()

    def start(self, *identities: str) -> None:
        """Start processes."""
        for identity in identities:
            line = self.host.command_line(identity)
            self.processes[identity] = subprocess.Popen(line, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)

    def wait(self, met: Callable[[], bool], seconds: float = 30.0) -> float:
        """Wait until it is so; returns when that was seen, s of the monotonic clock."""
        return self.loop.run_until_complete(self._wait(met, time.monotonic() + seconds))

    async def _wait(self, met: Callable[[], bool], deadline: float) -> float:
        while time.monotonic() < deadline:
            self.operator.poll()
            if met():
                return time.monotonic()
            await asyncio.sleep(0.0005)
        raise TimeoutError(met)

    def known(self) -> bool:
        """Return whether every drone's telemetry has come."""
        return len(self.operator.telemetry) == len(self.plan.pilots)

    def stopped(self) -> bool:
        """Return whether all motors are off."""
        states = [telemetry.state for telemetry in self.operator.telemetry.values()]
        return self.known() and all(state is FlightState.STOPPED for state in states)

    def fly(self) -> None:
        """Bring all into the formation."""
        self.start(*self.plan.started)
        line = [sys.executable, "-m", "flockwire_operator", "start", str(self.file), "--keys", str(self.keys)]
        subprocess.run(line, check=True, capture_output=True)

    def kept(self) -> float:
        """Stop by the session that is kept; returns the seconds that it took."""
        began = time.monotonic()
        self.operator.ask(Order("stop", reason="bench"))
        return self.wait(self.stopped) - began

    def one_shot(self) -> float:
        """Stop by the command; returns the seconds that it took."""
        began = time.monotonic()
        line = [str(Path(sys.executable).with_name("flockwire")), "stop", str(self.file), "--keys", str(self.keys)]
        process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        taken = self.wait(self.stopped) - began
        process.wait()
        return taken

    def end(self) -> None:
        """End everything."""
        self.session.close()
        for process in self.processes.values():
            process.kill()
        for process in self.processes.values():
            process.wait()


@contextlib.contextmanager
def bench() -> Iterator[Bench]:
    """Make a swarm for as long as the context lasts."""
    with tempfile.TemporaryDirectory() as folder:
        made = Bench(Path(folder))
        try:
            yield made
        finally:
            made.end()


@contextlib.contextmanager
def busy() -> Iterator[None]:
    """Keep all cores busy."""
    spinners = [multiprocessing.Process(target=_spin, daemon=True) for _ in range(os.cpu_count() or 1)]
    for spinner in spinners:
        spinner.start()
    try:
        yield
    finally:
        for spinner in spinners:
            spinner.kill()


def _spin() -> None:
    while True:
        pass


def row(name: str, seconds: list[float]) -> None:
    """Print one row of the table."""
    ordered = sorted(1000.0 * second for second in seconds)
    p99 = ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))]
    print(f"{name:44} {len(ordered):3} x   median {statistics.median(ordered):7.1f} ms   p99 {p99:7.1f} ms", flush=True)


def on_the_ground(stop: Callable[[Bench], float], runs: int) -> list[float]:
    """Return how long stops of drivers on the ground took."""
    taken = []
    for _ in range(runs):
        with bench() as swarm:
            swarm.start("kinematics")
            swarm.wait(swarm.known)
            taken.append(stop(swarm))
    return taken


def in_flight(stop: Callable[[Bench], float], victim: str = "") -> float:
    """Return how long a stop in formation took, with `victim` killed a second before."""
    with bench() as swarm:
        swarm.fly()
        if victim:
            swarm.processes[victim].send_signal(signal.SIGKILL)
            time.sleep(1.0)
        return stop(swarm)


def main() -> None:
    """Measure everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=30)
    parser.add_argument("--in-flight", type=int, default=3)
    options = parser.parse_args()
    row("kept session, on the ground", on_the_ground(Bench.kept, options.runs))
    row("one-shot, on the ground", on_the_ground(Bench.one_shot, options.runs))
    with busy():
        row("one-shot, on the ground, all cores busy", on_the_ground(Bench.one_shot, options.runs))
    for victim in ("", *VICTIMS):
        row(
            f"one-shot, in flight, {victim or 'nobody'} dead",
            [in_flight(Bench.one_shot, victim) for _ in range(options.in_flight)],
        )


if __name__ == "__main__":
    main()

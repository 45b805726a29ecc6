"""What messages cost through flockwire's session, Zenoh, CycloneDDS, MQTT and UDP: latency and processor time.

    .venv-dev/bin/python lab/bench/transport.py [--rounds 5] [--seconds 4] [--only NAME ...]

Two tests at 100 Hz, between processes of this host. Ping-pong: the round trip between two. Fan-out: the way from one to
five. All transports take turns in each round, and every figure is the median of the rounds: compare those of one run.
"Zenoh" has the same TLS and the same links as flockwire, its callback answers on Zenoh's own thread; "Zenoh, asyncio"
takes what arrives into the loop first, as MQTT's client does. "MQTT, TLS" authenticates both ends and encrypts, as
flockwire does. The rows from "flockwire, none" on have no security.
Every message is of the same size. CPU is that of all processes and the broker, for each message that is delivered.

The last columns are flockwire's p50, with its bar, p99 and CPU over those of the row, and the p50 of "flockwire, none"
over that of a row without security. Ends with status 1 when flockwire's median latency is above 1.15 of bare Zenoh's,
1.0 of CycloneDDS's or 0.5 of MQTT's.
"""

from __future__ import annotations

import argparse
import asyncio
import multiprocessing
import os
import statistics
import sys
import tempfile
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import Any

import transports
from flockwire_core import clock
from flockwire_core.runtime.ticker import Ticker
from transports import OURS, PLAIN, Place, Transport

RATE = 100  # Hz
WARM = 100  # messages that come before those that are measured
SETTLE = 1.0  # s from the last process's opening to the first message
MARK = 50  # messages between two looks at the processor time
TESTS = {"ping-pong": 2, "fan-out": 6}  # processes
BARS = {"Zenoh": 1.15, "MQTT, TLS": 0.5, "CycloneDDS": 1.0}  # times its p50
PORTS = count(21000, 100)


@dataclass
class Meter:
    """Counts what one process received: latencies, ns, and the processor time by the number of messages."""

    answers: bool
    latencies: list[int] = field(default_factory=list)
    marks: list[tuple[int, float]] = field(default_factory=list)
    messages: int = 0

    def receive(self, stamp: int) -> int | None:
        """Take a message that was stamped `stamp` (Unix ns); returns what is sent back."""
        self.latencies.append(clock.now() - stamp)
        self.count()
        return stamp if self.answers else None

    def count(self) -> None:
        """Take note of one more message."""
        self.messages += 1
        if self.messages >= WARM and self.messages % MARK == 0:
            self.marks.append((self.messages, clock.cpu_time()))

    def cost(self) -> float:
        """Return the processor time for each message, s; 0 when there were too few."""
        (first, before), (last, after) = self.marks[0], self.marks[-1]
        return (after - before) / (last - first) if last > first else 0.0


async def take_part(transport: Transport, place: Place, messages: int, go: Any, done: Any, results: Any) -> None:  # noqa: ANN401  (of multiprocessing)
    """Be one process: number 0 sends, the others receive, until all is done."""
    sends = place.number == 0
    meter = Meter(answers=not sends and place.count == TESTS["ping-pong"])
    async with transport.opened(place, meter.receive) as send:
        results.put(place.number)
        await asyncio.to_thread(go.wait)
        if sends:
            await _send(send, meter, messages, place.source is None)
            done.set()
        await asyncio.to_thread(done.wait)
    results.put((place.number, meter.latencies[WARM:], meter.cost() if meter.marks else 0.0, meter.messages))


async def _send(send: transports.Send, meter: Meter, messages: int, counts: bool) -> None:
    """Send so many `messages` at RATE; `counts` when nothing comes back that the meter could count."""
    await asyncio.sleep(SETTLE)
    sent, ended = 0, asyncio.Event()

    def tick(_lateness: int, _skipped: int) -> None:
        nonlocal sent
        if sent < messages:
            sent += 1
            send(clock.now())
            if counts:
                meter.count()
        else:
            ended.set()

    ticker = Ticker(1 / RATE, tick)
    ticker.start()
    await ended.wait()
    ticker.stop()
    await asyncio.sleep(0.2)


def participant(transport: str, place: Place, messages: int, go: Any, done: Any, results: Any) -> None:  # noqa: ANN401  (of multiprocessing)
    """Run `take_part` in a process of its own."""
    (found,) = (one for one in transports.transports() if one.name == transport)
    asyncio.run(take_part(found, place, messages, go, done, results))


def run(transport: Transport, test: str, folder: Path, messages: int) -> tuple[float, float, float, float]:
    """Return p50 and p99 of the latency, us, the processor time for each message delivered, us, and the share lost."""
    context, processes = multiprocessing.get_context("spawn"), TESTS[test]
    place = Place(folder, next(PORTS), processes)
    go, done, results = context.Event(), context.Event(), context.Queue()
    with transport.broker(place) if transport.broker else nullcontext(lambda: 0.0) as broker_time:
        places = [
            replace(place, number=i, source=0 if i else 1 if test == "ping-pong" else None) for i in range(processes)
        ]
        arguments = ((transport.name, one, messages + WARM, go, done, results) for one in places)
        children = [context.Process(target=participant, args=given) for given in arguments]
        for child in children:
            child.start()
        try:
            for _ in children:
                results.get(timeout=30.0)
            before = broker_time()
            go.set()
            found = [results.get(timeout=60.0 + messages / RATE) for _ in children]
            broker = broker_time() - before
        finally:
            for child in children:
                child.join(5.0)
                child.kill()
    receivers = [one for one in found if (one[0] == 0) == (test == "ping-pong")]
    latencies = sorted(latency for _, those, _, _ in receivers for latency in those)
    delivered = 2 if test == "ping-pong" else processes - 1  # for each message that process 0 sends
    cost = (sum(cost for _, _, cost, _ in found) + broker / (messages + WARM)) / delivered
    lost = 1.0 - sum(got for _, _, _, got in receivers) / len(receivers) / (messages + WARM)
    p50, p99 = statistics.median(latencies), latencies[int(0.99 * len(latencies))]
    return p50 / 1e3, p99 / 1e3, cost * 1e6, lost


def main() -> None:
    """Measure all, in turns."""
    every = list(transports.transports())
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=4.0)
    names = [one.name for one in every]
    parser.add_argument("--only", nargs="+", choices=names, metavar="NAME", help=f"besides flockwire, of {names}")
    options = parser.parse_args()
    known = [one for one in every if options.only is None or one.name in (OURS, *options.only)]
    for absent in (one for one in known if one.lacks):
        print(f"{absent.name}: skipped, not installed: {absent.lacks}")
    present = [one for one in known if not one.lacks]
    os.environ.update(clock.epoch_environment())
    rows: dict[tuple[str, str], list[tuple[float, float, float, float]]] = {}
    with tempfile.TemporaryDirectory() as text:
        transports.prepare(Place(Path(text), next(PORTS), max(TESTS.values())))
        for number in range(options.rounds):
            for test in TESTS:
                for transport in present:
                    row = run(transport, test, Path(text), round(options.seconds * RATE))
                    rows.setdefault((test, transport.name), []).append(row)
            print(f"round {number + 1} of {options.rounds}", file=sys.stderr, flush=True)
    sys.exit(not table(rows))


def table(rows: dict[tuple[str, str], list[tuple[float, float, float, float]]]) -> bool:
    """Print the medians; returns whether flockwire is within all bars."""
    within = True
    heading = ("p50 us", "p99 us", "CPU us/message", "lost")
    print(f"{'':28}{''.join(f'{name:>16}' for name in heading)}   flockwire: p50{'':17}p99  CPU    none: p50")
    medians = {row: [statistics.median(column) for column in zip(*found, strict=True)] for row, found in rows.items()}
    for test in TESTS:
        plain: float | None = None
        for name in (name for of, name in rows if of == test):
            p50, p99, cpu, lost = medians[test, name]
            ratios = [_over(mine, other) for mine, other in zip(medians[test, OURS], (p50, p99, cpu), strict=False)]
            plain = p50 if name == PLAIN else plain
            bar = BARS.get(name)
            verdict = "" if bar is None else f" {'within' if ratios[0] <= bar else 'ABOVE'} {bar:g}"
            within = within and (bar is None or ratios[0] <= bar)
            columns = f"{p50:16.0f}{p99:16.0f}{cpu:16.0f}{lost:16.2%}"
            over = f"{ratios[0]:17.2f}{verdict:16}{ratios[1]:.2f} {ratios[2]:.2f}"
            without = "" if plain is None else f"{_over(plain, p50):.2f}"
            print(f"{test:10}  {name:16}{columns}{over}{without:>13}".rstrip(), flush=True)
    return within


def _over(mine: float, other: float) -> float:
    return mine / other if other else float("nan")


if __name__ == "__main__":
    main()

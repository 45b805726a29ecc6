"""Clocks that are apart and drift, against true clocks: the same flights in virtual time, as a table.

    lab/bench/common_time.py [--flights 300] [--jobs 2]

Each flight of common_time.toml is flown twice with one seed. Printed are the smallest separation, the formation
error's tail of both and how far they differ, and the worst error of a corrected clock ten seconds after the start.
"""

from __future__ import annotations

import argparse
import tomllib
from math import inf
from multiprocessing import Pool
from pathlib import Path
from statistics import median
from typing import NamedTuple

from flockwire_analysis.summary import summarise
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import parse_swarm
from flockwire_core.wire.codec import decode
from flockwire_core.wire.status import Status
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.process import Published
from flockwire_lab.world import EPOCH, World

SWARM = Path(__file__).with_suffix(".toml")
REFERENCE = "gateway"
DURATION = 25.0  # s
KNOWN = 10 * SECOND  # ns after the start
TRUE = {"clock_offset": 0.0, "clock_drift": 0.0}


class Flight(NamedTuple):
    """What became of one flight; distances in m, clocks in ms."""

    seed: int
    failure: str
    separation: float
    tail: float
    rms: float
    clock: float  # worst error of a clock
    bound: float  # worst bound that a process reported


def fly(seed: int, clocks: dict[str, float]) -> Flight:
    """Fly once."""
    table = tomllib.loads(SWARM.read_text())
    table["sim"] |= clocks
    swarm = parse_swarm(table, SWARM.name)
    trace, worst = TraceInMemory(swarm, seed), [0.0, 0.0]

    def tap(published: Published) -> None:
        trace.take(published)
        row = published.sample.row
        if row.message is not Status or published.at < EPOCH + KNOWN:
            return
        status = decode(Status, published.sample.payload)
        off = published.sent - world.processes[REFERENCE].clock.read(published.at)
        worst[0], worst[1] = max(worst[0], abs(off) / 1e6), max(worst[1], 1e3 * status.clock_bound)

    world = World(swarm, seed, DURATION, tap=tap)
    outcome, summary = world.run(), summarise(trace.trace())
    error = summary.formation_error_m
    return Flight(
        seed, outcome.failure, summary.min_distance_uav_m or 0.0, error.max_tail or inf, error.rms_tail or inf, *worst
    )  # fmt: skip


def pair(seed: int) -> tuple[Flight, Flight]:
    """Fly with clocks that are off, and with true ones."""
    return fly(seed, {}), fly(seed, TRUE)


def main() -> None:
    """Fly all, print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=300)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    with Pool(options.jobs) as pool:
        pairs = list(pool.imap_unordered(pair, range(options.flights), chunksize=4))
    for name, flights in (("off", [off for off, _ in pairs]), ("true", [true for _, true in pairs])):
        failed = [flight for flight in flights if flight.failure]
        print(
            f"clocks {name:5} {len(flights)} flights, {len(failed)} failed, "
            f"separation {min(f.separation for f in flights):.3f} m at least, "
            f"tail {1e3 * median(f.tail for f in flights):.1f} mm median "
            f"{1e3 * max(f.tail for f in flights):.1f} worst, "
            f"rms {1e3 * median(f.rms for f in flights):.1f} median {1e3 * max(f.rms for f in flights):.1f} worst, "
            f"clock off by {max(f.clock for f in flights):.2f} ms at most, bound {max(f.bound for f in flights):.1f} ms"
        )
        for flight in failed[:5]:
            print(f"  seed {flight.seed}: {flight.failure}")
    apart = sorted(1e3 * abs(off.rms - true.rms) for off, true in pairs)
    peaks = sorted(1e3 * abs(off.tail - true.tail) for off, true in pairs)
    print(f"formation error differs by {median(apart):.2f} mm median, {apart[-1]:.2f} mm at most (rms of the tail)")
    print(f"                           {median(peaks):.2f} mm median, {peaks[-1]:.2f} mm at most (largest of the tail)")


if __name__ == "__main__":
    main()

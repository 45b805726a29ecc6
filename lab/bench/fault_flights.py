"""Faults in virtual time: short flights of the paper's swarm of five, each with one to three faults drawn by its seed.

    .compiled/bin/python lab/bench/fault_flights.py [--flights 5000] [--jobs 1] [--out runs/fault_flights] [--resume]
    .compiled/bin/python lab/bench/fault_flights.py --seed N          (flies one again, and prints what happened)

Drawn are the law, the airframe, for most of the flights other limits, and kinds, places and moments of the faults.
A tap judges on the fly, by the true positions; there is no trace. A collision is two drones in the air (above 0.15 m)
closer than 0.2 m. By law "paper", which promises no distance, that or an obstacle closer than 0.1 m is "near".
Counted separately: what a falling drone strikes (failed, or stopped), which nobody can avoid. When the kinematics are
killed the simulated world has ended, drones and all, and the flight is judged up to there; restarted, it puts all
drones on the ground.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from multiprocessing import Pool
from pathlib import Path
from statistics import median

from fault_draws import KINDS, VARIANTS
from fault_judge import Result, fly, fly_rare
from flockwire_lab import coverage
from flockwire_lab.search.record import REACTIONS
from rare_draws import RARE_KINDS


def print_tables(results: list[Result]) -> None:
    """Print what became of all flights."""
    outcomes = ("flew on", "landed early", "struck by a fall", "world ended", "near", "bad")
    rows: dict[str, Counter[str]] = defaultdict(Counter)
    for result in results:
        for kind in {fault["kind"] for fault in result.faults}:
            rows[kind][result.outcome] += 1
        rows["all"][result.outcome] += 1
        rows[f"law: {result.variant}"][result.outcome] += 1
    print(f"\n{'fault':24}{'flights':>9}" + "".join(f"{name:>18}" for name in outcomes))
    for kind in (*KINDS, *RARE_KINDS, *(f"law: {name}" for name in VARIANTS), "all"):
        print(f"{kind:24}{rows[kind].total():>9}" + "".join(f"{rows[kind][name]:>18}" for name in outcomes))
    print(f"\n{'reaction':28}{'flights':>9}    s after the fault began (one fault, usual limits): median, longest")
    for code in REACTIONS:
        count = sum(code in result.reactions for result in results)
        times = sorted(_times(code, results))
        timed = f"{median(times):8.2f}{times[-1]:8.2f}   of {len(times)}" if times else ""
        print(f"{code:28}{count:>9}{timed}")
    print("", *coverage.table(result.events for result in results), sep="\n")
    closest = min(results, key=lambda result: result.closest)
    fastest = max(results, key=lambda result: result.fastest_contact)
    print(f"\nclosest approach {closest.closest:.3f} m (seed {closest.seed})")
    print(f"fastest touch-down {fastest.fastest_contact:.2f} m/s (seed {fastest.seed})")
    print(f"longest flight {max(result.seconds for result in results):.1f} s")
    unpromised = [result for result in results if result.unpromised]
    seeds = ", ".join(str(result.seed) for result in unpromised)
    print(f'nearer by law "paper", which promises no distance: {len(unpromised)} flights  {seeds}')
    for result in results:
        if result.bad:
            kinds = ", ".join(f"{fault['kind']} {fault['at']:.1f}" for fault in result.faults)
            print(f"bad: --seed {result.seed}  {result.variant}: {kinds}: {'; '.join(result.bad)}")


def _times(code: str, results: Iterable[Result]) -> Iterator[float]:
    """Yield how long after its only fault a flight under the usual limits had a reaction."""
    for result in results:
        if code in result.reactions and result.usual and len(result.faults) == 1:
            since = result.reactions[code] - result.faults[0]["at"]
            if since >= 0.0:
                yield since


def _flown(file: Path, seeds: range) -> list[Result]:
    """Return the flights of `seeds` that a call that was ended left in `file`."""
    lines = file.read_text().splitlines() if file.exists() else []
    results = [Result(**json.loads(line)) for line in lines if line.endswith("}")]
    return [result for result in results if result.seed in seeds]


def main() -> int:
    """Fly one or many; returns 1 when something was bad."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--resume", action="store_true", help="go on with what is in the folder, of the same version")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--rare", action="store_true", help="add what few flights meet (rare_draws.py)")
    parser.add_argument("--out", type=Path, default=Path("runs/fault_flights"))
    options = parser.parse_args()
    if options.seed is not None:
        result = (fly_rare if options.rare else fly)(options.seed, print)
        print(json.dumps(asdict(result), indent=1))
        return bool(result.bad)
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / "flights.jsonl"
    wanted = range(options.first, options.first + options.flights)
    results = _flown(file, wanted) if options.resume else []
    done = {result.seed for result in results}
    seeds = [seed for seed in wanted if seed not in done]
    with Pool(options.jobs) as pool, file.open("a" if options.resume else "w") as log:
        for result in pool.imap(fly_rare if options.rare else fly, seeds, chunksize=4):
            results.append(result)
            log.write(json.dumps(asdict(result)) + "\n")
            log.flush()
            if result.bad:
                print(f"bad: --seed {result.seed}: {'; '.join(result.bad)}", file=sys.stderr, flush=True)
    print_tables(results)
    return any(result.bad for result in results)


if __name__ == "__main__":
    sys.exit(main())

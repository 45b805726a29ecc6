"""A search against as many draws over the four hardest families of flights: least margins side by side.

    .compiled/bin/python lab/bench/search.py [--flights 100] [--jobs 1] [--families NAME,...] [--out runs/search]

Both fly in the same space, are judged by the same margins (docs/study.md), and continue an earlier call. Each family
has a folder of `flockwire study`, with the commands that fly the worst again. Ends with status 1 with a violation.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import tomli_w
from fault_draws import SWARMS, stacked, tighten_fence
from flockwire_lab.search.choosing import worst_of
from flockwire_lab.search.corpus import flown

METHODS = ("search", "draws")
Table = dict[str, Any]


def five() -> Table:
    """Return the paper's swarm of five, with the extended law."""
    table = tomllib.loads((SWARMS / "paper_simulation.toml").read_text())
    table["control"]["law"] = "extended"
    return table


def tellos() -> Table:
    """Return the paper's five Tellos."""
    return tomllib.loads((SWARMS / "paper_flight.toml").read_text())


def above() -> Table:
    """Return a formation of pairs, one drone above the other."""
    table = five()
    table["formation"] = {"kind": "key_frames", "file": "stacked.csv"}
    return table


def narrow() -> Table:
    """Return a formation that reaches the fence, under a leader that flies towards it."""
    table = five()
    tighten_fence(table, "paper_simulation", Random(0))
    return table


FAMILIES: dict[str, tuple[Callable[[], Table], Table]] = {
    "five": (five, {}),
    "tellos": (tellos, {}),
    "above": (above, {"kinds": ["tracker", "cut", "freeze", "partition", "link", "restart", "lag", "second station"]}),
    "narrow": (narrow, {}),
}


def fly(name: str, method: str, options: argparse.Namespace) -> int:
    """Fly one family by one method; returns the status."""
    make, keys = FAMILIES[name]
    table = make()
    folder = options.out / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "stacked.csv").write_text(stacked()["frames"] + "\n")
    swarm, file = folder / "swarm.toml", folder / f"{method}.toml"
    swarm.write_text(tomli_w.dumps(table))
    file.write_text(tomli_w.dumps(keys | {"method": method}))
    line = [sys.executable, "-m", "flockwire_operator", "study", swarm, file, "--search", "--runs", options.flights,
            "--jobs", options.jobs, "--seed", options.seed, "--out", folder / method]  # fmt: skip
    return subprocess.run([*map(str, line)], check=False).returncode


def main() -> int:
    """Fly all, print the least margins; returns 1 with a violation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=100, help="of each family and method")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--out", type=Path, default=Path("runs/search"))
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended"))  # and with it the study that flies
    names = options.families.split(",")
    statuses = [fly(name, method, options) for name in names for method in METHODS]
    for name in names:
        found = {m: {e.number: e.judged for e in flown(options.out / name / m)} for m in METHODS}
        worst = {method: worst_of(judged) for method, judged in found.items()}
        violating = {m: sum(bool(j.violations) for j in judged.values()) for m, judged in found.items()}
        cells = {m: len({j.cell for j in judged.values() if j.margins}) for m, judged in found.items()}
        print(f"\n{name:12}" + "".join(f"{method:>10}" for method in METHODS))
        for quantity in sorted(set().union(*worst.values())):
            values = (
                f"{found[m][worst[m][quantity]].margins[quantity].value:10.3f}" if quantity in worst[m] else f"{'':>10}"
                for m in METHODS
            )
            print(f"{quantity:12}" + "".join(values))
        print(f"{'violating':12}" + "".join(f"{violating[method]:10}" for method in METHODS))
        print(f"{'cells':12}" + "".join(f"{cells[method]:10}" for method in METHODS))
        print(f"{'flights':12}" + "".join(f"{len(found[method]):10}" for method in METHODS))
    return int(any(statuses))


if __name__ == "__main__":
    sys.exit(main())

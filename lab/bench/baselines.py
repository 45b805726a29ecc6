"""The built-in laws beside laws from the literature, over the same flights, as one table.

    python lab/bench/baselines.py [--swarm FILE] [--flights 200] [--jobs 1] [--out runs/baselines]

FILE is a crowded swarm (separation/five.toml); `flockwire study` draws the starts and the tracker's noise and latency,
for each number of a flight the same ones with every law. A call that was stopped continues where it was, a larger
number extends it. `success`: all checks of the flight passed (docs/checks.md).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

BENCH = Path(__file__).parent
STUDY: dict[str, Any] = {
    "duration": 30.0,
    "starts": {"box": [6.0, 6.0], "fixed": [0]},
    "random": {
        "gateway.noise": {"uniform": [0.0, 0.002]},  # m
        "gateway.latency": {"uniform": [0.0, 0.02]},  # s
    },
}


class Row(NamedTuple):
    """A law with what else of the swarm file it needs."""

    name: str
    keys: dict[str, Any]


ROWS = (
    Row("extended", {"control.law": "extended"}),
    Row("paper", {"control.law": "paper"}),
    Row("sliding mode observer", {"control.law": "sliding_mode"}),
    Row("linear consensus", {"control.law": "consensus", "control.parameters": {"gain": 3.0}}),
    Row("ORCA", {"control.law": "orca"}),
)
HEADS = ("law", "flights", "success", "drones, m", "obstacles, m", "formation, mm", "observation, mm", "settled, s")


def fly(row: Row, swarm: Path, flights: int, jobs: int, out: Path) -> dict[str, Any]:
    """Fly what is still to be flown of a row; returns its entry in study.json."""
    out.mkdir(parents=True, exist_ok=True)
    study = out / "study.toml"
    study.write_text(tomli_w.dumps({**STUDY, "grid": {key: [value] for key, value in row.keys.items()}}))
    line = [sys.executable, "-m", "flockwire_operator", "study", str(swarm), str(study), "--runs", str(flights)]
    line += ["--jobs", str(jobs), "--out", str(out / "study")]
    done = subprocess.run(line, check=False, stdout=subprocess.DEVNULL)
    if done.returncode not in (0, 1):
        raise SystemExit(done.returncode)
    (point,) = json.loads((out / "study" / "study.json").read_text())["points"]
    return dict(point)


def cells(row: Row, point: dict[str, Any]) -> tuple[str, ...]:
    """Return a row of the table: the worst distance, of the errors and of settling the median and the worst."""
    figures = point["figures"]

    def shown(key: str, scale: float, digits: int, *which: str) -> str:
        values = [(figures[key] or {}).get(one) for one in which]
        return " / ".join("-" if value is None else f"{scale * value:.{digits}f}" for value in values)

    rate, low, high = (100.0 * point[key] for key in ("rate", "low", "high"))
    return (
        row.name,
        str(point["runs"]),
        f"{rate:.0f} % ({low:.0f} to {high:.0f})",
        shown("min_distance_uav_m", 1.0, 2, "worst"),
        shown("min_distance_obstacle_m", 1.0, 2, "worst"),
        shown("formation_tail_m", 1000.0, 1, "p50", "worst"),
        shown("observation_tail_m", 1000.0, 1, "p50", "worst"),
        shown("settled_s", 1.0, 1, "p50", "worst"),
    )


def main() -> None:
    """Fly all rows and print the table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--swarm", type=Path, default=BENCH / "separation/five.toml")
    parser.add_argument("--flights", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/baselines"))
    options = parser.parse_args()
    print("| " + " | ".join(HEADS) + " |")
    print("|" + "---|" * len(HEADS))
    for number, row in enumerate(ROWS):
        point = fly(row, options.swarm, options.flights, options.jobs, options.out / str(number))
        print("| " + " | ".join(cells(row, point)) + " |", flush=True)


if __name__ == "__main__":
    main()

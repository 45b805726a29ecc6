"""How well both laws keep drones apart: three crowded cases from random starts, as a table.

    python lab/bench/separation.py [RUNS] [--jobs 2] [--out runs/separation]

Flies `flockwire study` on the files in separation/. RUNS is the number of starts for each law; without
it the files' own, which takes hours. A call that was stopped continues where it was.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flockwire_core.loading import load_swarm

FILES = Path(__file__).parent / "separation"


@dataclass(frozen=True, slots=True)
class Case:
    """A swarm file, and the study that varies it."""

    swarm: str
    study: str


CASES = (
    Case("five", "five_study"),
    Case("five_tello", "five_study"),
    Case("twelve", "twelve_study"),
)
COLUMNS = {  # heading: width
    "case, law": 22,
    "runs": 6,
    "success (95 % sure)": 30,
    "drones, m": 11,
    "obstacles, m": 14,
    "speed / limit": 15,
    "error, mm": 18,
    "settled, s": 12,
}


def fly(case: Case, runs: int | None, jobs: int, out: Path) -> list[dict[str, Any]]:
    """Fly what is still to be flown of a case; returns the entries of each law in study.json."""
    files = [str(FILES / f"{name}.toml") for name in (case.swarm, case.study)]
    command = [sys.executable, "-m", "flockwire_operator", "study", *files, "--out", str(out), "--jobs", str(jobs)]
    if runs is not None:
        command += ["--runs", str(runs)]
    done = subprocess.run(command, check=False, stdout=subprocess.DEVNULL)
    if done.returncode == 2:
        raise SystemExit(2)
    points: list[dict[str, Any]] = json.loads((out / "study.json").read_text())["points"]
    return points


def cells(case: Case, point: dict[str, Any]) -> tuple[str, ...]:
    """Return a row of the table: the worst of all runs, of the error also the median."""
    figures, limit = point["figures"], load_swarm(FILES / f"{case.swarm}.toml").limits.speed

    def shown(key: str, which: str, scale: float, digits: int) -> str:
        value = (figures[key] or {}).get(which)
        return "-" if value is None else f"{scale * value:.{digits}f}"

    rate, low, high = (100.0 * point[key] for key in ("rate", "low", "high"))
    return (
        f"{case.swarm}, {point['point']['control.law']}",
        str(point["runs"]),
        f"{rate:.2f} % ({low:.2f} to {high:.2f})",
        shown("min_distance_uav_m", "worst", 1.0, 3),
        shown("min_distance_obstacle_m", "worst", 1.0, 3),
        shown("max_speed_m_s", "worst", 1.0 / limit, 3),
        " / ".join(shown("formation_tail_m", which, 1000.0, 2) for which in ("p50", "worst")),
        shown("settled_s", "worst", 1.0, 1),
    )


def main() -> None:
    """Fly all cases and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", metavar="RUNS", type=int, nargs="?")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/separation"))
    options = parser.parse_args()
    rows = [tuple(COLUMNS)]
    for case in CASES:
        points = fly(case, options.runs, options.jobs, options.out / case.swarm)
        rows += [cells(case, point) for point in points]
    for row in rows:
        print("".join(f"{cell:>{width}}" for cell, width in zip(row, COLUMNS.values(), strict=True)))
    print("smallest distances, highest speed, formation error in the tail (median / worst), slowest settling")


if __name__ == "__main__":
    main()

"""What mutual TLS and access control cost: the paper's flight with and without them, in turn, in one run.

    .venv-dev/bin/python lab/bench/security.py [--rounds 3] [--seconds 15]

Each round flies both; the ratios are those of the medians over the rounds.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from flockwire_analysis.reading import read_trace

PAPER = Path(__file__).parents[2] / "examples" / "paper_simulation.toml"
FIGURES = ("p50 ms", "p99 ms", "agent CPU %", "observation mm", "formation mm")


def fly(folder: Path, security: str, number: int, seconds: float) -> dict[str, float]:
    """Fly once; returns the figures."""
    swarm_file, out = folder / f"{security}.toml", folder / f"{security}{number}"
    swarm_file.write_text(PAPER.read_text() + f'\n[network]\nsecurity = "{security}"\nbase_port = 15100\n')
    command = [sys.executable, "-m", "flockwire_operator", "up", str(swarm_file), "--headless"]
    options = ["--duration", str(seconds), "--out", str(out), "--keys", str(folder / "keys")]
    subprocess.run([*command, *options], check=False, capture_output=True)
    summary = json.loads((out / "summary.json").read_text())
    agents = [row for row in read_trace(out / "trace.mcap").vitals if row.last.identity.startswith("uav")]
    latency = summary["latency_ms"]["pose_to_command"]
    return {
        "p50 ms": latency["p50"],
        "p99 ms": latency["p99"],
        "agent CPU %": 100 * statistics.fmean(row.cpu for row in agents),
        "observation mm": 1000 * summary["observation_error_m"]["max_tail"],
        "formation mm": 1000 * summary["formation_error_m"]["max_tail"],
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=15.0)
    options = parser.parse_args()
    rows: dict[str, list[dict[str, float]]] = {"mtls": [], "none": []}
    print(f"{'security':10}" + "".join(f"{name:>16}" for name in FIGURES))
    with tempfile.TemporaryDirectory() as folder:
        for number in range(options.rounds):
            for security, found in rows.items():
                found.append(fly(Path(folder), security, number, options.seconds))
                print(f"{security:10}" + "".join(f"{found[-1][name]:16.2f}" for name in FIGURES), flush=True)
    medians = {name: [statistics.median(row[name] for row in rows[s]) for s in rows] for name in FIGURES}
    print(f"{'ratio':10}" + "".join(f"{with_ / without:16.2f}" for with_, without in medians.values()))


if __name__ == "__main__":
    main()

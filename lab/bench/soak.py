"""A long real flight of the paper's swarm: memory stays flat, nothing is lost, nothing is skipped.

    .venv-dev/bin/python lab/bench/soak.py [SECONDS]      (1800 s of flight by `flockwire up`)

Memory is the resident set of each process, MB: after five minutes, at the end, and the most in between. A leader that
flies on would leave any fence: here it circles, with the paper's law, formation and graph.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import defaultdict
from pathlib import Path

import psutil
import tomli_w

SWARM = Path(__file__).parents[2] / "examples/paper_simulation.toml"
SETTLED = 300.0  # s of flight after which memory must be flat
SAMPLING = 5.0  # s between two samples of memory
FLAT = 1.0  # MB that a process may grow by after SETTLED
MB = 2**20
Samples = dict[str, list[tuple[float, float]]]  # by process: s of flight, MB


def sample(up: psutil.Process, samples: Samples, t: float) -> None:
    """Add the memory of the processes that `up` started."""
    for process in up.children(recursive=True):
        try:
            words = [word for word in process.cmdline()[3:] if not word.startswith(("-", "/"))]
            samples[" ".join(words[:2])].append((t, process.memory_info().rss / MB))
        except psutil.Error:
            continue


def is_flat(samples: Samples) -> bool:
    """Print each process's memory; return whether all stayed flat after SETTLED."""
    settled = min(SETTLED, max(t for listed in samples.values() for t, _ in listed) / 4.0)
    print(f"{'process':24}{f'MB at {settled:.0f} s':>14}{'most after':>12}{'at the end':>12}{'growth':>9}")
    flat = True
    for name, listed in sorted(samples.items()):
        later = [size for t, size in listed if t >= settled] or [listed[-1][1]]
        growth = later[-1] - later[0]
        flat = flat and growth <= FLAT
        print(f"{name:24}{later[0]:14.1f}{max(later):12.1f}{later[-1]:12.1f}{growth:9.1f}")
    return flat


def main() -> int:
    """Fly; returns 1 when something was not as it must be."""
    seconds, samples = float(sys.argv[1]) if len(sys.argv) > 1 else 1800.0, Samples(defaultdict(list))
    table = tomllib.loads(SWARM.read_text()) | {"network": {"base_port": 19000}}
    table["leader"]["trajectory"] = {"kind": "circle", "radius": 1.0, "rate": 0.1}
    table.setdefault("airframes", {}).setdefault("kinematics", {})["endurance"] = 4.0 * seconds
    with tempfile.TemporaryDirectory() as folder:
        swarm, out = Path(folder) / "soak.toml", Path(folder) / "out"
        swarm.write_text(tomli_w.dumps(table))
        line = [sys.executable, "-m", "flockwire_operator", "up", str(swarm), "--headless", "--duration", str(seconds),
                "--out", str(out), "--keys", str(Path(folder) / "keys")]  # fmt: skip
        up, began = subprocess.Popen(line), time.monotonic()
        while up.poll() is None:
            sample(psutil.Process(up.pid), samples, time.monotonic() - began)
            time.sleep(SAMPLING)
        summary = json.loads((out / "summary.json").read_text())
    lost, skipped = summary["messages"]["lost"], summary["steps"]["skipped"]
    print(f"lost {lost}, skipped {skipped}, rejected {summary['messages']['rejected']}")
    return not is_flat(samples) or bool(up.returncode or lost or skipped)


if __name__ == "__main__":
    sys.exit(main())

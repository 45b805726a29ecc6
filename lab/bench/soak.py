"""A long flight of the paper's swarm: memory stays flat, nothing is lost, nothing is skipped.

    .compiled/bin/python lab/bench/soak.py --virtual 7200      (s of flight in virtual time, in this process)
    .venv-dev/bin/python lab/bench/soak.py --real 1800             (s of flight by `flockwire up`, in real processes)

Memory is the resident set, MB: after five minutes, at the end, and the most in between. A leader that flies on at
0.14 m/s would leave any fence within two hours: here it circles, with the paper's law, formation and graph.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import tomli_w
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import uav
from flockwire_core.wire.status import Status
from flockwire_lab.process import Published
from flockwire_lab.world import EPOCH, World

SWARM = Path(__file__).parents[2] / "examples/paper_simulation.toml"
SETTLED = 300.0  # s of flight after which memory must be flat
SAMPLING = 10.0  # s between two samples of memory
FLAT = 1.0  # MB that a process may grow by after SETTLED
MB = 1024.0 * 1024.0
Samples = dict[str, list[tuple[float, float]]]  # by process: s of flight, MB


def swarm_table(endurance: float) -> dict[str, Any]:
    """Return the paper's swarm with a leader that circles and a battery that lasts `endurance` s."""
    table = tomllib.loads(SWARM.read_text())
    table["leader"]["trajectory"] = {"kind": "circle", "radius": 1.0, "rate": 0.1}
    table.setdefault("airframes", {}).setdefault("kinematics", {})["endurance"] = endurance
    return table


class Counts:
    """Counts in virtual time: poses that no step answered, skipped steps, rejected messages, memory."""

    def __init__(self) -> None:
        self.skipped: dict[str, int] = {}
        self.rejected: dict[str, int] = {}
        self.samples: Samples = defaultdict(list)
        self._poses: Counter[str] = Counter()  # by drone
        self._ahead: dict[str, list[int]] = defaultdict(list)  # poses more than steps, first and most, by pilot
        self._sample_at = 0.0

    @property
    def lost(self) -> int:
        """Poses that their pilots never stepped for."""
        return sum(last - first for first, last in self._ahead.values())

    def take(self, published: Published) -> None:
        """Receive one message."""
        kind, owner = published.key
        if kind == "pose":
            self._poses[owner] += 1
        if kind != "status":
            return
        status = published.message
        if isinstance(status, Status):
            self._count(status)
        t = (published.at - EPOCH) / SECOND
        if t >= self._sample_at:
            self._sample_at = t + SAMPLING
            self.samples["simulation"].append((t, resident()))

    def _count(self, status: Status) -> None:
        name = status.identity
        self.skipped[name] = status.skipped
        self.rejected[name] = sum(count for _, count in status.rejected)
        drone = uav(0) if name == "leader" else name
        if drone in self._poses:
            ahead = self._poses[drone] - status.steps
            first, most = self._ahead[name] or (ahead, ahead)
            self._ahead[name] = [first, max(most, ahead)]


def resident() -> float:
    """Return the MB that this process has in memory."""
    fields = Path("/proc/self/statm").read_text().split()
    return int(fields[1]) * 4096 / MB


def virtual(seconds: float) -> bool:
    """Fly `seconds` of virtual time; returns whether all was as it must be."""
    counts = Counts()
    began = time.process_time()
    outcome = World(parse_swarm(swarm_table(4.0 * seconds), "soak"), 0, seconds, tap=counts.take).run()
    used = time.process_time() - began
    print(f"{outcome.seconds:.0f} s of flight in {used:.0f} s of processor time; {outcome.failure or 'no failure'}")
    print(f"lost {counts.lost}, skipped {sum(counts.skipped.values())}, rejected {sum(counts.rejected.values())}")
    flat = print_memory(counts.samples)
    return flat and not (outcome.failure or counts.lost or sum(counts.skipped.values()))


def real(seconds: float) -> bool:
    """Fly `seconds` with `flockwire up`; returns whether all was as it must be."""
    import psutil  # noqa: PLC0415  (not needed in virtual time)

    samples: Samples = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        swarm, out = Path(folder) / "soak.toml", Path(folder) / "out"
        swarm.write_text(tomli_w.dumps(swarm_table(4.0 * seconds) | {"network": {"base_port": 19000}}))
        line = [sys.executable, "-m", "flockwire_operator", "up", str(swarm), "--headless", "--duration", str(seconds),
                "--out", str(out), "--keys", str(Path(folder) / "keys")]  # fmt: skip
        up = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        began = time.monotonic()
        while up.poll() is None:
            for process in psutil.process_iter(["cmdline", "memory_info"]):
                words = process.info["cmdline"] or []
                if str(swarm) in words and process.info["memory_info"] is not None:
                    name = " ".join(words[words.index("flockwire_operator") + 1 :]).split(str(swarm))
                    number = name[1].split()[:1] if name[0].strip() == "agent" else []
                    identity = " ".join([name[0].strip(), *number])
                    samples[identity].append((time.monotonic() - began, process.info["memory_info"].rss / MB))
            time.sleep(min(SAMPLING, max(0.5, seconds / 30.0)))
        assert up.stdout is not None
        said = up.stdout.read().splitlines()
        print("\n".join(said[-3:]))
        summary = json.loads((out / "summary.json").read_text())
    drawing = max(t for name, listed in samples.items() if name != "up" for t, _ in listed)
    samples["up"] = [(t, size) for t, size in samples["up"] if t <= drawing]  # after the flight it draws the report
    flat = print_memory(samples)
    lost, skipped = summary["messages"]["lost"], summary["steps"]["skipped"]
    print(f"lost {lost}, skipped {skipped}, rejected {summary['messages']['rejected']}")
    return flat and not (up.returncode or lost or skipped)


def print_memory(samples: Samples) -> bool:
    """Print each process's memory; returns whether all stayed flat after SETTLED."""
    longest = max(t for listed in samples.values() for t, _ in listed)
    settled = min(SETTLED, longest / 4.0)
    columns = f"{f'MB at {settled:.0f} s':>14}{'most after':>12}{'at the end':>12}{'growth':>9}"
    print(f"{'process':14}{columns}   every {SETTLED:.0f} s")
    flat = True
    for name, listed in sorted(samples.items()):
        later = [size for t, size in listed if t >= settled] or [listed[-1][1]]
        growth = later[-1] - later[0]
        flat = flat and growth <= FLAT
        marks = [next(size for t, size in listed if t >= mark) for mark in range(0, int(listed[-1][0]), int(SETTLED))]
        series = " ".join(f"{size:.1f}" for size in marks)
        print(f"{name:14}{later[0]:14.1f}{max(later):12.1f}{later[-1]:12.1f}{growth:9.1f}   {series}")
    return flat


def main() -> int:
    """Fly as told; returns 1 when something was not as it must be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kind = parser.add_mutually_exclusive_group(required=True)
    kind.add_argument("--virtual", type=float, metavar="SECONDS")
    kind.add_argument("--real", type=float, metavar="SECONDS")
    options = parser.parse_args()
    good = virtual(options.virtual) if options.virtual else real(options.real)
    print("flat, nothing lost, nothing skipped" if good else "NOT as it must be")
    return not good


if __name__ == "__main__":
    sys.exit(main())

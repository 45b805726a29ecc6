"""What a flight costs in two trees, in turns: processes, latency, memory, virtual time, calls; medians and ratios.

    .venv-dev/bin/python lab/bench/cost.py TREE_A TREE_B [--rounds 5] [--seconds 10] [--followers 5 10] [--only KIND]

A tree is a checkout. It runs in its .compiled if it has one (scripts/compile; calls are counted in .venv-dev), or
in its .venv-dev, or in this one's with PYTHONPATH. KIND is flights or virtual. Flights are real ones of five and ten
followers (agents.py): the processor time of each process by its schedstat, and its memory (VmHWM) as the kernel has
it, so that no tree's own account of itself counts; pose to command is from summary.json. Virtual time is that of the
paper's five drones (sim_speed.py of each tree); calls are those of Python functions in a virtual second.
The last column is B / A; compare figures of one run only, on a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import psutil
from agents import swarm_file

SMALL, LARGE = 5, 10  # followers
STARTING = 6.0  # s from the last process's start until all fly in formation
MARGIN = 10.0  # s of a flight beside those that are measured
VIRTUAL = 5.0  # s of the virtual flights that are timed
CALLS = (2.0, 4.0)  # s of the two virtual flights between which calls are counted
SPEED = re.compile(r"trace (on|off): ([\d.]+) x real time")
COUNTING = """import cProfile, contextlib, io, pstats, runpy, sys
profile, sys.argv = cProfile.Profile(builtins=False), ["flockwire", *sys.argv[1:]]
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit), profile:
    runpy.run_module("flockwire_operator", run_name="__main__")
print(pstats.Stats(profile).total_calls)"""


@dataclass(frozen=True, slots=True)
class Tree:
    """A checkout, and how its programs run."""

    root: Path
    compiled: bool

    @classmethod
    def at(cls, path: str) -> Tree:
        """Return the tree in folder `path`, compiled if it was compiled."""
        root = Path(path).resolve()
        return cls(root, (root / ".compiled").exists())

    def python(self) -> str:
        """Return its interpreter."""
        own = self.root / (".compiled" if self.compiled else ".venv-dev") / "bin/python"
        return str(own) if own.exists() else sys.executable

    def environment(self) -> dict[str, str]:
        """Return the environment in which its own packages are imported before any other's."""
        if self.compiled:
            return dict(os.environ)
        packages = sorted({str(one.parent.parent) for one in self.root.glob("*/flockwire*/__init__.py")})
        return os.environ | {"PYTHONPATH": os.pathsep.join(packages)}

    def start(self, *arguments: str, **options: int) -> subprocess.Popen[str]:
        """Start Python with `arguments`."""
        return subprocess.Popen(
            [self.python(), *arguments], env=self.environment(), text=True, stdout=subprocess.PIPE, **options
        )


def processes(parent: subprocess.Popen[str], file: Path) -> dict[str, int]:
    """Return the process ids of a flight by what they run: `agent 1`, `gateway`."""
    found = {}
    for child in psutil.Process(parent.pid).children(recursive=True):
        with contextlib.suppress(psutil.Error, ValueError):
            line = child.cmdline()
            place = line.index(str(file))
            found[" ".join([line[place - 1], *(word for word in line[place + 1 :] if word.isdecimal())])] = child.pid
    return found


def busy(process: int) -> float:
    """Return the processor time that `process` has used, s: of all its threads."""
    threads = Path(f"/proc/{process}/task").glob("*/schedstat")
    return sum(int(thread.read_text().split()[0]) for thread in threads) / 1e9


def peak(process: int) -> float:
    """Return the most memory that was resident in `process`, MB."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024


def fly(tree: Tree, folder: Path, followers: int, seconds: float) -> dict[str, float]:
    """Fly once; returns the figures by their names."""
    file, out = swarm_file(folder, followers), folder / "out"
    line = ("up", str(file), "--headless", "--keys", str(folder / "keys"), "--out", str(out))
    up = tree.start("-m", "flockwire_operator", *line, "--duration", str(seconds + MARGIN), stderr=subprocess.DEVNULL)
    expected, deadline = followers + len(("leader", "gateway", "kinematics", "recorder")), time.monotonic() + 60.0
    while len(running := processes(up, file)) < expected:
        if time.monotonic() > deadline or up.poll() is not None:
            up.terminate()
            raise SystemExit(f"{tree.root}: `up` of {followers} followers started {sorted(running)} only")
        time.sleep(0.2)
    time.sleep(STARTING)
    before, began = {name: busy(process) for name, process in running.items()}, time.monotonic()
    time.sleep(seconds)
    shares = {
        name: 100 * (busy(process) - before[name]) / (time.monotonic() - began) for name, process in running.items()
    }
    memory = {name: peak(process) for name, process in running.items()}
    up.communicate()
    latency = json.loads((out / "summary.json").read_text())["latency_ms"]["pose_to_command"]
    agents = [name for name in running if name.startswith("agent ")]
    return {
        f"one agent's CPU, {followers} drones, %": statistics.median(shares[name] for name in agents),
        f"one agent's memory, {followers} drones, MB": statistics.median(memory[name] for name in agents),
        f"gateway's CPU, {followers} drones, %": shares["gateway"],
        f"recorder's CPU, {followers} drones, %": shares["recorder"],
        f"pose to command p50, {followers} drones, ms": latency["p50"],
        f"pose to command p99, {followers} drones, ms": latency["p99"],
    }


def speeds(tree: Tree) -> dict[str, float]:
    """Return how many times faster than real time virtual flights are, by the tree's own bench, which is then ended."""
    bench, found = tree.start(str(tree.root / "lab/bench/sim_speed.py"), str(VIRTUAL)), {}
    assert bench.stdout is not None
    for line in bench.stdout:
        if match := SPEED.search(line):
            found[f"virtual time, trace {match[1]}, times real time"] = float(match[2])
        if len(found) == 2:
            break
    bench.kill()
    bench.communicate()
    return found


def calls(tree: Tree) -> dict[str, float]:
    """Return the calls of Python functions in a virtual second: by what a longer flight has more than a shorter one."""
    file, counts = str(tree.root / "examples/paper_simulation.toml"), []
    for seconds in CALLS:
        line = ("-c", COUNTING, "sim", file, "--no-trace", "--duration", str(seconds))
        said, _ = replace(tree, compiled=False).start(*line).communicate()
        counts.append(int(said.split()[-1]))
    return {"calls in a virtual second": (counts[1] - counts[0]) / (CALLS[1] - CALLS[0])}


def main() -> None:
    """Measure both, in turns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trees", type=Tree.at, nargs=2, metavar="TREE")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--followers", type=int, nargs="+", default=[SMALL, LARGE])
    parser.add_argument("--only", choices=("flights", "virtual"))
    options = parser.parse_args()
    figures: dict[str, list[list[float]]] = defaultdict(lambda: [[], []])

    def measure(of: Callable[[Tree], dict[str, float]]) -> None:
        for number, tree in enumerate(options.trees):
            for name, figure in of(tree).items():
                figures[name][number].append(figure)

    def flight(tree: Tree, followers: int) -> dict[str, float]:
        with tempfile.TemporaryDirectory() as folder:
            return fly(tree, Path(folder), followers, options.seconds)

    for number in range(options.rounds):
        print(f"round {number + 1} of {options.rounds}, load {psutil.getloadavg()[0]:.1f}", file=sys.stderr, flush=True)
        if options.only != "virtual":
            for followers in options.followers:
                measure(partial(flight, followers=followers))
        if options.only != "flights":
            measure(speeds)
    if options.only != "flights":
        measure(calls)  # the same in every round
    print(f"{'':44}{'A':>12}{'B':>12}{'B / A':>8}   ranges")
    for name, (ours, theirs) in figures.items():
        a, b = statistics.median(ours), statistics.median(theirs)
        ranges = "   ".join(f"{min(those):.2f} to {max(those):.2f}" for those in (ours, theirs))
        print(f"{name:44}{a:12.2f}{b:12.2f}{b / a:8.2f}   {ranges}")


if __name__ == "__main__":
    main()

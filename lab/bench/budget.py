"""What flights cost, counted and not timed, beside its budget: budget.toml has a limit for each figure, and a reason.

    .venv-dev/bin/python lab/bench/budget.py [--flight]

Virtual: the paper's five drones, by what a flight of four s has more than one of two. Calls are those of Python
functions, allocations those of the interpreter's allocators (what comes from its free lists is not among them), for
each virtual second. Agent: one real process, alone, a second after it opened its session. `--flight` adds one that
flies among others: its system calls (strace), in a second. Ends with status 1 when a figure is above its budget.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

from agents import swarm_file
from cost import SMALL, STARTING, Tree, processes
from counting import COUNTER, PAPER
from flockwire_core import clock
from flockwire_core.loading import load_swarm
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.plan import Plan

BUDGET = Path(__file__).with_suffix(".toml")
TRACED = 5.0  # s of system calls


class Budget(NamedTuple):
    """The most that a figure may be, and why so much."""

    most: float
    reason: str


def budgets() -> dict[str, Budget]:
    """Return the budget of each figure; raises KeyError for one without a limit or a reason."""
    rows = tomllib.loads(BUDGET.read_text(encoding="utf-8"))
    return {name: Budget(row["most"], row["reason"]) for name, row in rows.items()}


def counted() -> dict[str, float]:
    """Return all figures that need no flight; what cannot be counted here is left out, and named."""
    with tempfile.TemporaryDirectory() as text, ThreadPoolExecutor() as pool:
        folder = Path(text)
        _lay_out(folder)
        counts = ["calls", "agent"]
        if shutil.which("cc") is None:
            print("allocations: skipped, there is no C compiler: apt-get install gcc", file=sys.stderr)
        else:
            source = Path(__file__).with_name("allocations.c")
            subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-o", folder / COUNTER, source], check=True)
            counts.append("allocations")
        return {name: figure for found in pool.map(partial(_count, folder), counts) for name, figure in found.items()}


def in_flight() -> dict[str, float]:
    """Return what is counted of an agent in a real flight."""
    if shutil.which("strace") is None:
        print("system calls: skipped, strace is not installed: apt-get install strace", file=sys.stderr)
        return {}
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        file = swarm_file(folder, SMALL)
        line = ("up", str(file), "--headless", "--keys", str(folder / "keys"), "--out", str(folder / "out"))
        seconds = str(STARTING + TRACED)
        up = Tree(Path(__file__).parents[2], compiled=False).start(
            "-m", "flockwire_operator", *line, "--duration", seconds, stderr=subprocess.DEVNULL
        )
        while "agent 1" not in (found := processes(up, file)):
            if up.poll() is not None:
                raise SystemExit("the flight did not begin")
            time.sleep(0.2)
        time.sleep(STARTING)
        tracer = subprocess.Popen(["strace", "-f", "-c", "-o", str(folder / "calls"), "-p", str(found["agent 1"])])
        time.sleep(TRACED)
        tracer.send_signal(signal.SIGINT)
        tracer.wait()
        up.communicate()
        (total,) = (line for line in (folder / "calls").read_text().splitlines() if line.endswith("total"))
    return {"system calls of an agent in flight, a second": int(total.split()[3]) / TRACED}


def _lay_out(folder: Path) -> None:
    """Put what an agent of the paper's swarm needs into `folder`."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (folder / "swarm.toml").write_text(f"{PAPER.read_text()}\n[network]\nbase_port = {20000 + port % 10000}\n")
    make_keys(Plan(load_swarm(folder / "swarm.toml")), folder / "keys", clock.utc())


def _count(folder: Path, what: str) -> dict[str, float]:
    """Count in a process of its own, in which nothing else was done and sets have the same order each time."""
    line = [sys.executable, str(Path(__file__).with_name("counting.py")), what, str(folder)]
    done = subprocess.run(line, env=os.environ | {"PYTHONHASHSEED": "0"}, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"counting {what} failed: {done.stderr.strip()}")
    found: dict[str, float] = json.loads(done.stdout)
    return found


def main() -> None:
    """Count everything and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flight", action="store_true")
    options = parser.parse_args()
    found, within = counted() | (in_flight() if options.flight else {}), True
    print(f"{'':46}{'counted':>12}{'budget':>12}{'share':>8}")
    for name, budget in budgets().items():
        if name in found:
            within = within and found[name] <= budget.most
            share = f"{found[name] / budget.most:8.2f}" if budget.most else ""
            print(f"{name:46}{found[name]:12.0f}{budget.most:12.0f}{share}")
    sys.exit(not within)


if __name__ == "__main__":
    main()

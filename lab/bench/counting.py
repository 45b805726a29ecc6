"""Counts, in a process of its own, what lab/bench/budget.py compares with a budget; prints it as JSON.

    PYTHONHASHSEED=0 .venv-dev/bin/python lab/bench/counting.py calls|allocations|agent FOLDER

`calls` and `allocations` fly the paper's five drones in virtual time, `agent` is one real agent that is alone. In
FOLDER stand the compiled counter of allocations (budget.py) and what the agent needs.
"""

from __future__ import annotations

import cProfile
import ctypes
import json
import os
import pstats
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from operator import sub
from pathlib import Path
from typing import Any

PAPER = Path(__file__).parents[2] / "examples/paper_simulation.toml"
SHORT, LONG = 2.0, 4.0  # s of the virtual flights between which is counted
SETTLED = 1.0  # s from an agent's first session until it is looked at
COUNTER = "allocations.so"
OPENSSL = ("libssl", "libcrypto")
AGENT = ("agent", "swarm.toml", "1", "--keys", "keys")
_OUTPUT = os.dup(1)  # an agent reads its own output, where Zenoh's log stands


def flier() -> Callable[[float], int]:
    """Return what flies so many s, and returns how many messages were published."""
    from flockwire_core.loading import load_swarm  # noqa: PLC0415  (an agent's own imports are counted)
    from flockwire_lab.world import World  # noqa: PLC0415

    swarm = load_swarm(PAPER)

    def fly(seconds: float) -> int:
        messages = 0

        def take(_: object) -> None:
            nonlocal messages
            messages += 1

        World(swarm, 0, seconds, tap=take).run()
        return messages

    fly(1.0)  # what is done only once
    return fly


def calls(_: Path) -> dict[str, float]:
    """Count calls of Python functions, and messages."""
    fly = flier()

    def counted(seconds: float) -> tuple[int, int]:
        profile = cProfile.Profile(builtins=False)
        with profile:
            messages = fly(seconds)
        return pstats.Stats(profile).total_calls, messages  # type: ignore[attr-defined]

    called, messages = (difference / (LONG - SHORT) for difference in map(sub, counted(LONG), counted(SHORT)))
    return {"calls in a virtual second": called, "messages in a virtual second": messages}


def allocations(folder: Path) -> dict[str, float]:
    """Count what the interpreter's allocators give out."""
    counter = ctypes.PyDLL(str(folder / COUNTER))
    counter.allocations.restype = ctypes.c_ulonglong
    fly = flier()
    counter.count_allocations()

    def allocated(seconds: float) -> int:
        before = counter.allocations()
        fly(seconds)
        return int(counter.allocations() - before)

    return {"allocations in a virtual second": (allocated(LONG) - allocated(SHORT)) / (LONG - SHORT)}


def agent(folder: Path) -> dict[str, float]:
    """Run an agent, look at it once it waits for the others, and end it there."""
    imported: set[object] = set()
    sys.addaudithook(lambda event, given: imported.add(given[0]) if event == "import" else None)
    import zenoh  # noqa: PLC0415  (an agent's own)

    opened: Counter[str] = Counter()
    own = zenoh.open

    def open_session(*given: Any) -> zenoh.Session:  # noqa: ANN401  (whatever Zenoh takes)
        opened["sessions"] += 1
        return own(*given)

    zenoh.open = open_session

    def look() -> None:
        while not opened["sessions"]:
            time.sleep(0.05)
        time.sleep(SETTLED)
        mapped = {Path(line.split()[-1]).name for line in Path("/proc/self/maps").read_text().splitlines()}
        status = dict(line.split(":\t", 1) for line in Path("/proc/self/status").read_text().splitlines())
        show(
            {
                "Zenoh sessions of an agent": opened["sessions"],
                "threads of an agent": int(status["Threads"]) - 1,  # this one
                "memory of an agent, MB": int(status["VmHWM"].split()[0]) / 1024,
                "libraries of OpenSSL in an agent": sum(name.startswith(OPENSSL) for name in mapped),
                "modules that an agent imports": len(imported.union(sys.modules)),
                "modules resident in an agent": len(sys.modules),
            }
        )
        os._exit(0)

    os.chdir(folder)
    threading.Thread(target=look, daemon=True).start()
    sys.argv = ["flockwire", *AGENT]
    from flockwire_operator.cli.entry import main  # noqa: PLC0415  (counted too)

    main()
    raise RuntimeError("the agent ended unexpectedly")


def show(found: dict[str, float]) -> None:
    """Print the figures."""
    os.write(_OUTPUT, json.dumps(found).encode())


COUNTS = {count.__name__: count for count in (calls, allocations, agent)}


if __name__ == "__main__":
    show(COUNTS[sys.argv[1]](Path(sys.argv[2])))

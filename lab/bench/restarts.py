"""Whether each kind of process rejoins a flight after kill -9 and a restart, at once, after 3 s, after 10 s.

    lab/bench/restarts.py [--repeats 3] [--busy]

The swarm of the paper is started process by process and flies the formation. Then one process is killed and restarted.
It has rejoined when all fly the formation again, within 0.1 m of their places, 5 s after its restart; otherwise all
must come to rest, and a single `flockwire start` must bring them back.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import subprocess
import sys
import time

from flockwire_core.wire.phase import Phase
from stop import Bench, bench, busy

VICTIMS = ("uav2", "leader", "gateway", "recorder", "kinematics")
DELAYS = (0.0, 3.0, 10.0)
REJOIN = 5.0  # s
CLOSE = 0.1  # m
LANDED = 30.0  # s that whoever does not rejoin may take to come to rest, and to be brought back


def in_place(swarm: Bench) -> bool:
    """Return whether all fly the formation, close to their places."""
    fleet = swarm.operator.fleet()
    errors = [status.report.formation_error for status in fleet.fresh.values()]
    return fleet.all_in(Phase.FORMATION) and max(errors) < CLOSE


def at_rest(swarm: Bench) -> bool:
    """Return whether all hold, stand ready, or fly the formation."""
    return swarm.operator.fleet().all_in(Phase.READY, Phase.HOLD, Phase.FORMATION)


def restart(victim: str, delay: float) -> str:
    """Fly, kill and restart `victim`; returns what came of it."""
    with bench() as swarm:
        swarm.fly()
        swarm.wait(lambda: in_place(swarm))
        swarm.processes[victim].send_signal(signal.SIGKILL)
        swarm.processes[victim].wait()
        time.sleep(delay)
        if victim == "recorder":
            (swarm.out / "trace.mcap").rename(swarm.out / "before.mcap")
        swarm.start(victim)
        began = time.monotonic()
        with contextlib.suppress(TimeoutError):
            time.sleep(0.5)
            swarm.wait(lambda: victim in _alive(swarm), 10.0)
            return f"rejoined after {swarm.wait(lambda: in_place(swarm), REJOIN) - began:.1f} s"
        try:
            swarm.wait(lambda: at_rest(swarm), LANDED)
            line = [sys.executable, "-m", "flockwire_operator", "start", str(swarm.file), "--keys", str(swarm.keys)]
            done = subprocess.run(line, capture_output=True, text=True, check=False)
            if done.returncode:
                return f"LOST: start failed: {done.stderr.strip()[-120:]}"
            swarm.wait(lambda: in_place(swarm), LANDED)
        except TimeoutError:
            phases = {name: status.report.phase for name, status in swarm.operator.statuses.items()}
            return f"LOST: {phases}"
        return "brought back by one start"


def _alive(swarm: Bench) -> set[str]:
    now = swarm.operator.poll()
    return {name for name, status in swarm.operator.statuses.items() if now - status.stamp < 500_000_000}


def main() -> None:
    """Restart everything, print a row for each case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--busy", action="store_true", help="keep all cores busy meanwhile")
    options = parser.parse_args()
    lost = 0
    with busy() if options.busy else contextlib.nullcontext():
        for victim in VICTIMS:
            for delay in DELAYS:
                for _ in range(options.repeats):
                    result = restart(victim, delay)
                    lost += result.startswith("LOST")
                    print(f"{victim:11} after {delay:4.1f} s: {result}", flush=True)
    print(f"{lost} lost")


if __name__ == "__main__":
    main()

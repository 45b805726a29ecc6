"""How many agents one machine carries: real flights of growing swarms, their cost, latency and delays as a table.

    .venv-dev/bin/python lab/bench/agents.py [--followers 5 10 20] [--seconds 15]

Beside each flight stands the machine's own floor at that moment: the round trip of a UDP datagram between processes,
and how late a timer wakes an idle process. Compare rows of one run only.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import socket
import statistics
import subprocess
import sys
import tempfile
from math import cos, pi, sin
from pathlib import Path

from flockwire_analysis.reading import read_trace
from flockwire_core import clock
from flockwire_core.runtime.ticker import Ticker

FLOOR_SAMPLES = 300
ECHO = (
    "import socket,sys; s=socket.socket(type=socket.SOCK_DGRAM); s.bind(('127.0.0.1',0));"
    "print(s.getsockname()[1],flush=True)\nwhile True: d,a=s.recvfrom(99); s.sendto(d,a)"
)


def swarm_file(folder: Path, followers: int) -> Path:
    """Write the swarm file of `followers` on a circle: a binary tree from the leader, room enough for all."""
    radius = max(2.0, 1.0 * followers / pi)
    lines = [
        f'name = "bench{followers}"',
        f'[formation]\nkind = "circle"\nradius = {radius}\nrate = {1.0 / radius}',
        f"[limits.fence]\nmin = [{-radius - 5}, {-radius - 5}, -0.5]\nmax = [{radius + 9}, {radius + 9}, 3.0]",
        f"[graph]\nedges = {[[i // 2, i] for i in range(1, followers + 1)]}",
        "[network]\nbase_port = 15000",
        "[[drones]]\nid = 0\nstart = [0.0, 0.0, 0.0]",
    ]
    for i in range(followers):
        angle = 2 * pi * i / followers
        place = [round(1.1 * radius * sin(angle), 3), round(1.1 * radius * cos(angle), 3), 0.0]
        lines.append(f"[[drones]]\nid = {i + 1}\nstart = {place}")
    path = folder / f"bench{followers}.toml"
    path.write_text("\n".join(lines))
    return path


def udp_floor() -> float:
    """Return the median round trip of a datagram to another process and back, ms."""
    with subprocess.Popen([sys.executable, "-c", ECHO], stdout=subprocess.PIPE, text=True) as echo:
        assert echo.stdout is not None
        port = int(echo.stdout.readline())
        with socket.socket(type=socket.SOCK_DGRAM) as ours:
            trips = []
            for _ in range(FLOOR_SAMPLES):
                began = clock.monotonic()
                ours.sendto(b"x" * 84, ("127.0.0.1", port))
                ours.recv(99)
                trips.append(clock.monotonic() - began)
        echo.kill()
    return statistics.median(trips) / 1e6


async def timer_floor() -> float:
    """Return the 99th percentile of a 100 Hz timer's lateness, ms."""
    lateness: list[int] = []
    ticker = Ticker(0.01, lambda late, _: lateness.append(late))
    ticker.start()
    await asyncio.sleep(FLOOR_SAMPLES / 100)
    ticker.stop()
    return sorted(lateness)[int(0.99 * len(lateness))] / 1e6


def fly(folder: Path, followers: int, seconds: float) -> dict[str, float]:
    """Fly one swarm and return its row of the table."""
    row = {"udp": udp_floor(), "timer": asyncio.run(timer_floor())}
    file, keys, out = swarm_file(folder, followers), folder / f"keys{followers}", folder / f"out{followers}"
    command = [sys.executable, "-m", "flockwire_operator", "up", str(file), "--headless", "--keys", str(keys)]
    subprocess.run([*command, "--duration", str(seconds), "--out", str(out)], check=False, capture_output=True)
    summary = json.loads((out / "summary.json").read_text())
    vitals = read_trace(out / "trace.mcap").vitals
    agents = [row for row in vitals if row.last.identity.startswith("uav")]
    steps, latency = summary["steps"], summary["latency_ms"]["pose_to_command"]
    return row | {
        "agent_cpu": 100 * statistics.median(row.cpu for row in agents),
        "agent_mb": max(row.last.resident for row in agents) / 2**20,
        "gateway_cpu": 100 * next(row.cpu for row in vitals if row.last.identity == "gateway"),
        "p50": latency["p50"],
        "p99": latency["p99"],
        "delayed": 100 * steps["delayed_1ms"] / steps["made"],
        "delayed5": 100 * steps["delayed_5ms"] / steps["made"],
        "skipped": 100 * steps["skipped"] / steps["made"],
        "rate": 100 * min(summary["rate"].values()),
        "lost": summary["messages"]["lost"],
        "error": 1000 * summary["formation_error_m"]["max_tail"],
    }


COLUMNS = (
    ("agent_cpu", "agent CPU %"), ("agent_mb", "agent MB"), ("gateway_cpu", "gateway %"),
    ("p50", "p50 ms"), ("p99", "p99 ms"), ("delayed", ">1 ms %"), ("delayed5", ">5 ms %"),
    ("skipped", "skipped %"), ("rate", "worst rate %"), ("lost", "lost"), ("error", "error mm"),
    ("udp", "UDP floor ms"), ("timer", "timer p99 ms"),
)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--followers", type=int, nargs="+", default=[5, 10, 20])
    parser.add_argument("--seconds", type=float, default=15.0)
    options = parser.parse_args()
    print("agents  " + "  ".join(heading for _, heading in COLUMNS), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for followers in options.followers:
            row = fly(Path(folder), followers, options.seconds)
            cells = (f"{row[name]:>{len(heading)}.{0 if row[name] > 99 else 2}f}" for name, heading in COLUMNS)
            print(f"{followers:6}  " + "  ".join(cells), flush=True)


if __name__ == "__main__":
    main()

"""The conformance probe on random graphs: what it finds and how long it takes, as a table.

.venv-dev/bin/python lab/bench/probe.py [--agents 8] [--graphs 3] [--mode peers]
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
from math import cos, pi, sin
from pathlib import Path


def swarm_file(folder: Path, agents: int, seed: int, mode: str) -> Path:
    """Write a swarm whose graph is a random spanning tree with as many further edges again."""
    dice = random.Random(seed)
    edges = {(dice.randrange(i), i) for i in range(1, agents + 1)}
    while len(edges) < 2 * agents:
        source, target = dice.randrange(agents + 1), dice.randrange(1, agents + 1)
        if source != target:
            edges.add((source, target))
    lines = [
        f'name = "random{seed}"',
        'formation = { kind = "circle", radius = 3.0 }',
        f"graph = {{ edges = {sorted(list(edge) for edge in edges)} }}",
        f'network = {{ mode = "{mode}", base_port = 15300 }}',
        "[[drones]]\nid = 0\nstart = [0.0, 0.0, 0.0]",
    ]
    for i in range(1, agents + 1):
        place = [round(3.0 * sin(2 * pi * i / agents), 3), round(3.0 * cos(2 * pi * i / agents), 3), 0.0]
        lines.append(f"[[drones]]\nid = {i}\nstart = {place}")
    path = folder / f"random{seed}.toml"
    path.write_text("\n".join(lines))
    return path


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, default=8)
    parser.add_argument("--graphs", type=int, default=3)
    parser.add_argument("--mode", choices=("peers", "router"), default="peers")
    options = parser.parse_args()
    print("graph  leaks  blocked  attackers  seconds")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for seed in range(options.graphs):
            swarm = swarm_file(folder, options.agents, seed, options.mode)
            out = folder / f"out{seed}"
            command = [sys.executable, "-m", "flockwire_operator", "probe", str(swarm), "--out", str(out)]
            subprocess.run([*command, "--keys", str(folder / f"keys{seed}")], check=False, capture_output=True)
            found = json.loads((out / "probe.json").read_text())
            counts = len(found["leaks"]), len(found["blocked"]), len(found["attackers"])
            print(f"{seed:5}  {counts[0]:5}  {counts[1]:7}  {counts[2]:9}  {found['seconds']:7.1f}", flush=True)
            for sentence in (found["leaks"] + found["blocked"])[:5]:
                print(f"       {sentence}")


if __name__ == "__main__":
    main()

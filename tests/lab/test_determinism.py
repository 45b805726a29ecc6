"""Equal seeds, equal bytes: across runs, across hash seeds, whatever is left to chance."""

from __future__ import annotations

import gc
import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import pytest
from flockwire_core.wire.plan import Plan
from flockwire_lab.process import Published
from flockwire_lab.world import COLLECT_AFTER, World

SWARM = """
name = "chance"
formation = { kind = "circle", radius = 1.5, rate = 0.4 }
graph = { edges = [[0, 1], [1, 2], [0, 3], [2, 3]] }
drones = [
  { id = 0, start = [0.0, 0.0, 0.0] }, { id = 1, start = [1.5, 0.0, 0.0] },
  { id = 2, start = [-1.5, 0.0, 0.0] }, { id = 3, start = [0.0, 1.5, 0.0] },
]
gateway = { noise = 0.002, dropout = 0.02 }
sim = { delay = 0.004, jitter = 0.004, loss = 0.02, reordering = 0.02, clock_offset = 0.003, clock_drift = 5e-5 }
"""
FAULTS = """
[[faults]]
at = 2.0
kind = "restart"
process = "uav2"
[[faults]]
at = 2.4
kind = "noise"
noise = 0.01
duration = 0.5
"""


def flown(folder: Path, hash_seed: int, *seeds: int) -> list[str]:
    """Fly with each of `seeds` in a process of its own; returns the digests of the traces."""
    (folder / "chance.toml").write_text(SWARM)
    (folder / "faults.toml").write_text(FAULTS)
    program = f"""
from pathlib import Path
from flockwire_core.loading import load_swarm
from flockwire_lab.faults.file import load_faults
from flockwire_core.wire.plan import Plan
from flockwire_lab.flight import TraceFile
from flockwire_lab.world import World
swarm = load_swarm(Path("chance.toml"))
for seed in {seeds}:
    trace = TraceFile(Path(f"{{seed}}.mcap"), swarm, "", seed)
    World(swarm, seed, 3.0, load_faults(Path("faults.toml"), Plan(swarm)), trace.take).run()
    trace.close()
"""
    environment = {**os.environ, "PYTHONHASHSEED": str(hash_seed)}
    subprocess.run([sys.executable, "-c", program], cwd=folder, env=environment, check=True, timeout=60)
    return [hashlib.sha256((folder / f"{seed}.mcap").read_bytes()).hexdigest() for seed in seeds]


def test_equal_seeds_give_equal_traces_and_others_do_not(tmp_path: Path) -> None:
    first, other = flown(tmp_path, 1, 7, 8)
    assert flown(tmp_path, 2, 8) == [other]  # as the first of its process, too
    assert first != other


@pytest.mark.parametrize("fails", [False, True])
def test_cycles_are_looked_for_rarely_during_a_flight_alone(make_plan: Callable[..., Plan], fails: bool) -> None:
    usual, during = gc.get_threshold(), set[tuple[int, ...]]()

    def tap(_: Published) -> None:
        during.add(gc.get_threshold())
        if fails:
            raise BufferError

    with pytest.raises(BufferError) if fails else nullcontext():
        World(make_plan().swarm, 0, 0.1, tap=tap).run()
    assert during == {(COLLECT_AFTER, *usual[1:])}
    assert gc.get_threshold() == usual

"""One swarm, flown for real and in virtual time: the same errors, the same messages; the same faults, the same end.

The law of the first flight is the documented example of one's own; test_up.py compares the paper's.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import agree, flockwire
from flockwire.keys import all_keys
from flockwire_recorder.phases import formation_phase
from flockwire_recorder.reading import Trace, read_trace

DURATION = 12


def fly_both(swarm: Path, folder: Path, *options: str | Path) -> dict[str, tuple[int, str, Path]]:
    """Fly for real and in virtual time; returns status, last line of errors and folder of each."""
    flown = {}
    for world, extra in (("up", ["--headless"]), ("sim", [])):
        out = folder / world
        process = flockwire(world, swarm, *extra, "--duration", str(DURATION), "--out", out, *options)
        _, errors = process.communicate(timeout=120)
        flown[world] = (process.returncode, (errors.strip().splitlines() or [""])[-1], out)
    return flown


def test_the_documented_law_flies_and_errors_and_message_counts_agree(
    documented_law: str, make_swarm: Callable[..., Path], tmp_path: Path
) -> None:
    flown = fly_both(make_swarm(law=f'"{documented_law}"'), tmp_path)
    assert {status for status, _, _ in flown.values()} == {0}, flown
    summaries = [json.loads((flown[world][2] / "summary.json").read_text()) for world in ("up", "sim")]
    agree(*summaries)
    assert max(summary["formation_error_m"]["max_tail"] for summary in summaries) < 0.07  # 0.14 m/s over a gain of 3
    traces = [read_trace(flown[world][2] / "trace.mcap") for world in ("up", "sim")]
    swarm = traces[0].swarm
    for key in all_keys(swarm):
        if key.kind in ("mission", "stop"):
            continue
        counts = [_per_second(trace, key) for trace in traces]
        assert counts[0] == pytest.approx(counts[1], rel=0.02, abs=0.2), key
    orders = [[mission.verb for mission in trace.missions] for trace in traces]
    assert orders[0] == orders[1] == ["takeoff", "start", "land"]


def _per_second(trace: Trace, key: object) -> float:
    """Return how often a key was said in the formation phase."""
    phase = formation_phase(trace)
    assert phase is not None
    series = trace.series.get(key)
    return 0.0 if series is None else float(phase.holds(series.published).sum()) / phase.length


FAULTS = """
[[faults]]
at = 5.0
kind = "freeze"
process = "uav2"
duration = 0.5
[[faults]]
at = 6.0
kind = "noise"
noise = 0.01
duration = 1.0
[[faults]]
at = 8.0
kind = "tracker"
drone = 3
duration = 2.0
"""


def test_the_same_faults_have_the_same_end(make_swarm: Callable[..., Path], tmp_path: Path) -> None:
    faults = tmp_path / "faults.toml.txt"
    faults.write_text(FAULTS)
    flown = fly_both(make_swarm(), tmp_path, "--faults", faults)
    for world, (status, reason, out) in flown.items():
        assert status == 1, world
        assert "uav3 left the formation: own pose lost" in reason, world
        trace = read_trace(out / "trace.mcap")
        takeoff = next(mission.stamp for mission in trace.missions if mission.verb == "takeoff")

        def count(kind: str, number: int, begin: float, end: float, trace=trace, takeoff=takeoff) -> int:
            seconds = (trace.of(kind, number).published - takeoff) / 1e9
            return int(((seconds > begin) & (seconds < end)).sum())

        assert count("command", 2, 5.1, 5.45) == 0, world
        assert count("command", 2, 5.7, 6.7) > 90, world
        assert count("pose", 3, 8.1, 9.9) == 0, world
        assert count("pose", 1, 8.1, 9.9) > 170, world


def test_what_only_virtual_time_can_do_is_refused_before_anything_starts(
    make_swarm: Callable[..., Path], tmp_path: Path
) -> None:
    faults = tmp_path / "cut.txt"
    faults.write_text('[[faults]]\nat = 1.0\nkind = "cut"\nfrom = "uav1"\nto = "uav2"\nduration = 1.0\n')
    process = flockwire("up", make_swarm(), "--headless", "--out", tmp_path / "out", "--faults", faults)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 2
    assert errors.strip().splitlines() == [
        f"flockwire: {faults}: faults.0.kind = 'cut': only `flockwire sim` can do this; a real flight cannot"
    ]
    assert not (tmp_path / "out").exists()

"""One swarm, flown for real and in virtual time: the same errors, the same messages; the same faults, the same end.

The law of the first flight is the documented example of your own; test_up.py compares the paper's.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import CONTROL_RATE, agree, flockwire
from flockwire_analysis.phases import formation_phases
from flockwire_analysis.reading import read_trace
from flockwire_analysis.recorded import Trace
from flockwire_core.wire.keys import TIME_REPLY, TIME_REQUEST
from independent_reader import read

DURATION = 12


def fly_both(
    swarm: Path, folder: Path, *options: str | Path, duration: float = DURATION
) -> dict[str, tuple[int, str, Path]]:
    """Fly for real and in virtual time; returns status, last line of errors and folder of each."""
    flown = {}
    for world, extra in (("up", ["--headless"]), ("sim", [])):
        out = folder / world
        process = flockwire(world, swarm, *extra, "--duration", str(duration), "--out", out, *options)
        _, errors = process.communicate(timeout=120)
        flown[world] = (process.returncode, (errors.strip().splitlines() or [""])[-1], out)
    return flown


@pytest.mark.long
def test_the_documented_law_flies_and_errors_and_message_counts_agree(
    documented_law: str, make_swarm: Callable[..., Path], tmp_path: Path
) -> None:
    flown = fly_both(make_swarm(law=f'"{documented_law}"\nparameters.gain = 10.0'), tmp_path)
    assert {status for status, _, _ in flown.values()} == {0}, flown
    summaries = [json.loads((flown[world][2] / "summary.json").read_text()) for world in ("up", "sim")]
    agree(*summaries)
    tail = max(summary["formation_error_m"]["max_tail"] for summary in summaries)
    assert tail < 0.07  # 0.14 m/s over a gain of 10, in a chain of four
    traces = [read_trace(flown[world][2] / "trace.mcap") for world in ("up", "sim")]
    # What the machine had no time for: poses that the gateway did not publish, steps that an agent did not make.
    poses = min(
        _per_second(traces[0], key) / _per_second(traces[1], key) for key in traces[0].plan.keys if key.kind == "pose"
    )
    assert poses > CONTROL_RATE
    skipped = max(0.0, 1.0 - poses * min(summaries[0]["rate"].values()))
    for key in traces[0].plan.keys:
        if key.kind in ("mission", "stop", TIME_REQUEST, TIME_REPLY):  # requests get rare once the offset is known
            continue
        counts = [_per_second(trace, key) for trace in traces]
        assert counts[0] == pytest.approx(counts[1], rel=0.02 + skipped, abs=0.2), key
    orders = [[mission.verb for mission in trace.missions] for trace in traces]
    assert orders[0] == orders[1] == ["takeoff", "start", "land"]


def _per_second(trace: Trace, key: object) -> float:
    """Return how often a key was said in the formation phase."""
    phase = formation_phases(trace)[0].span
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


@pytest.mark.long
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


BROKEN_LINKS = """
[[faults]] # the link stays up
at = 4.0
kind = "cut"
from = "gateway"
to = "uav1"
duration = 0.4
[[faults]] # long enough to take the link down
at = 5.0
kind = "cut"
from = "uav1"
to = "uav2"
duration = 1.5
[[faults]]
at = 7.5
kind = "link"
from = "uav1"
to = "uav2"
duration = 0.9
delay = 0.6
[[faults]] # what arrives now is worth nothing
at = 8.2
kind = "link"
from = "uav1"
to = "uav2"
duration = 0.2
delay = 1.05
jitter = 0.02
"""


@pytest.mark.long
def test_links_break_and_slow_down_in_both_worlds_and_the_formation_settles_again(
    make_swarm: Callable[..., Path], tmp_path: Path
) -> None:
    faults = tmp_path / "links.txt"
    faults.write_text(BROKEN_LINKS)
    flown = fly_both(make_swarm(), tmp_path, "--faults", faults, duration=17.0)
    for world, (status, reason, out) in flown.items():
        assert status == 0, (world, reason)
        summary = json.loads((out / "summary.json").read_text())
        assert list(summary["messages"]["rejected_by_key"]) == ["paper/uav1/estimate expired"], world
        assert summary["messages"]["rejected"] > 10, world
        assert 7.3 < summary["formation_error_m"]["settled_s"] < 12.0, world
        assert summary["formation_error_m"]["max_tail"] < 0.08, world
        topics = read(out / "trace.mcap")
        takeoff = next(_seconds(mission) for mission in topics["/paper/mission"] if mission.verb == "takeoff")

        def told(name: str, begin: float, end: float, topics=topics, takeoff=takeoff) -> list:
            return [s for s in topics[f"/paper/{name}/status"] if begin < _seconds(s) - takeoff < end]

        assert max(s.pose_age for s in told("uav1", 4.0, 4.6)) == pytest.approx(0.4, abs=0.12), world
        assert max(s.estimate_age for s in told("uav2", 5.0, 6.9)) == pytest.approx(1.5, abs=0.2), world
        assert max(s.estimate_age for s in told("uav2", 7.1, 7.5)) < 0.1, world
        assert max(s.estimate_age for s in told("uav2", 8.2, 9.6)) > 1.0, world
        assert {s.phase for s in told("uav2", 6.35, 6.5)} == {"hold"}, world
        for pilot in ("uav1", "uav2", "uav3", "uav4"):
            assert {s.phase for s in told(pilot, 13.0, 16.5)} == {"formation"}, (world, pilot)


def _seconds(message: object) -> float:
    return message.header.stamp.sec + message.header.stamp.nanosec / 1e9


def test_what_only_virtual_time_can_do_is_refused_before_anything_starts(
    make_swarm: Callable[..., Path], tmp_path: Path
) -> None:
    faults = tmp_path / "clock.txt"
    faults.write_text('[[faults]]\nat = 1.0\nkind = "clock"\nprocess = "uav1"\nstep = 0.1\n')
    process = flockwire("up", make_swarm(), "--headless", "--out", tmp_path / "out", "--faults", faults)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 2
    assert errors.strip().splitlines() == [
        f"flockwire: {faults}: faults.0.kind = 'clock': only `flockwire sim` can do this; a real flight cannot"
    ]
    assert not (tmp_path / "out").exists()

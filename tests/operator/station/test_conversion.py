"""Trajectories of other programs, written as their documentation has them, become key frames that fly."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from math import dist
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import tomli_w
from flockwire_core.control.key_frames import KeyFrames, parse_key_frames
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.trajectories import course_of

if TYPE_CHECKING:
    from command_line import CommandLine

AXES = ("x", "y", "z", "yaw")
CRAZYSWARM = "duration," + ",".join(f"{axis}^{k}" for axis in AXES for k in range(8)) + "\n"
SKYBRUSH = "Time [msec],x [m],y [m],z [m],Red,Green,Blue\n"
TUM = "# timestamp tx ty tz qx qy qz qw\n"


def piece(duration: float, **axes: list[float]) -> str:
    """Return a row of Crazyswarm's CSV; coefficients not given are 0."""
    numbers = [c for axis in AXES for c in (axes.get(axis, []) + [0.0] * 8)[:8]]
    return ",".join(map(str, [duration, *numbers])) + "\n"


@pytest.fixture
def convert(flockwire: CommandLine, tmp_path: Path) -> Callable[..., KeyFrames]:
    """Return a function that converts files and reads what was written."""

    def converted(*files: Path, options: tuple[object, ...] = ()) -> KeyFrames:
        out = tmp_path / "out.csv"
        done = flockwire("convert", *files, "--out", out, *options)
        assert done.returncode == 0, done.stderr
        assert 'kind = "key_frames"' in done.stdout
        return parse_key_frames(out.read_text())

    return converted


def test_polynomial_pieces_of_crazyswarm_follow_each_other(convert: Callable[..., KeyFrames], tmp_path: Path) -> None:
    """It climbs 1 m with t^2, then flies 2 m along y with t^3 / 4."""
    file = tmp_path / "uav.csv"
    file.write_text(
        CRAZYSWARM + piece(1.0, z=[0.0, 0.0, 1.0], x=[0.5]) + piece(2.0, z=[1.0], x=[0.5], y=[0.0, 0.0, 0.0, 0.25])
    )
    found = convert(file)
    assert (found.count, found.end) == (1, 3.0)
    for t, place in ((0.0, (0.5, 0.0, 0.0)), (0.5, (0.5, 0.0, 0.25)), (1.0, (0.5, 0.0, 1.0)), (2.0, (0.5, 0.25, 1.0))):
        assert dist(found.offset(0, t), place) < 1e-5
    assert dist(found.offset(0, 9.0), (0.5, 2.0, 1.0)) < 1e-5


def show(path: Path, referenced: bool) -> Path:
    """Write a compiled show of two drones: one on a cubic curve that begins at 5 s, one that stands."""
    curve = {
        "version": 1,
        "takeoffTime": 5.0,
        "points": [[0.0, [0.0, 0.0, 0.0], []], [4.0, [4.0, 0.0, 8.0], [[0.0, 0.0, 4.0], [4.0, 0.0, 4.0]]]],
    }
    stands = {"version": 1, "points": [[0.0, [9.0, 1.0, 2.0], []], [9.0, [9.0, 1.0, 2.0], []]]}
    with zipfile.ZipFile(path, "w") as archive:
        drones = []
        for name, trajectory in (("Drone 1", curve), ("Drone 2", stands)):
            place = f"drones/{name}/trajectory.json"
            archive.writestr(place, json.dumps(trajectory))
            given = {"$ref": f"./{place}#"} if referenced else trajectory
            drones.append({"type": "generic", "settings": {"name": name, "home": [0, 0, 0], "trajectory": given}})
        archive.writestr("show.json", json.dumps({"version": 1, "settings": {}, "swarm": {"drones": drones}}))
    return path


@pytest.mark.parametrize("referenced", [True, False])
def test_curves_of_a_skybrush_show_begin_at_its_take_off_time(
    convert: Callable[..., KeyFrames], tmp_path: Path, referenced: bool
) -> None:
    found = convert(show(tmp_path / "show.skyc", referenced))
    assert (found.count, found.end) == (2, 9.0)
    assert found.offset(0, 3.0) == (0.0, 0.0, 0.0)
    assert dist(found.offset(0, 7.0), (2.0, 0.0, 4.0)) < 1e-5  # the middle of the curve
    assert dist(found.offset(0, 6.0), (0.625, 0.0, 2.375)) < 1e-5
    assert found.offset(1, 4.0) == (9.0, 1.0, 2.0)


def test_tables_of_skybrush_are_taken_by_the_numbers_in_their_names(
    convert: Callable[..., KeyFrames], tmp_path: Path
) -> None:
    with zipfile.ZipFile(tmp_path / "show.zip", "w") as archive:
        for drone in (10, 2, 1):
            rows = [f"{33 * k},{drone}.0,{0.033 * k:.3f},1.5,255,0,0" for k in range(100)]
            archive.writestr(f"Drone {drone}.csv", SKYBRUSH + "\n".join(rows) + "\n")
    found = convert(tmp_path / "show.zip", options=("--rate", 5))
    assert [found.offset(rank, 0.0)[0] for rank in range(3)] == [1.0, 2.0, 10.0]
    assert dist(found.offset(2, 1.65), (10.0, 1.65, 1.5)) < 0.01
    assert found.end == pytest.approx(3.267)
    assert 15 <= len(found.times[0]) <= 19


def test_a_trajectory_of_tum_becomes_the_leaders_path(
    convert: Callable[..., KeyFrames], tmp_path: Path, swarm_table: Callable[..., dict[str, Any]]
) -> None:
    rows = [f"{1305031102.1 + 0.02 * k:.4f} {1.0 + 0.01 * k:.4f} 2.0 1.0 0 0 0 1" for k in range(101)]
    (tmp_path / "carried.txt").write_text(TUM + "\n".join(rows) + "\n")
    found = convert(tmp_path / "carried.txt", options=("--leader",))
    assert (found.offset(0, 0.0), found.end) == ((0.0, 0.0, 0.0), 2.0)
    path = {"leader.trajectory": {"kind": "key_frames", "file": "out.csv"}}
    (tmp_path / "swarm.toml").write_text(tomli_w.dumps(swarm_table(path)))
    course = course_of(load_swarm(tmp_path / "swarm.toml").leader)
    assert dist(course.position(1.0), (0.5, 0.0, 0.0)) < 1e-3
    assert dist(course.rate(1.0), (0.5, 0.0, 0.0)) < 0.02
    assert course.fastest == pytest.approx(0.5, abs=0.3)
    assert course.position(5.0) == course.position(2.0)


def test_a_leader_has_one_path(tmp_path: Path, swarm_table: Callable[..., dict[str, Any]]) -> None:
    (tmp_path / "two.csv").write_text("t,drone,x,y,z\n0,1,0,0,0\n0,2,1,0,0\n")
    path = {"leader.trajectory": {"kind": "key_frames", "file": "two.csv"}}
    (tmp_path / "swarm.toml").write_text(tomli_w.dumps(swarm_table(path)))
    with pytest.raises(ValueError, match=r"two\.csv has offsets for 2 drones, must have the path of one"):
        load_swarm(tmp_path / "swarm.toml")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is none of: Crazyswarm's CSV"),
        ("a,b,c\n1,2,3\n", "is none of: Crazyswarm's CSV"),
        (CRAZYSWARM, "has no point"),
        (CRAZYSWARM + "1.0,2.0\n", "line 2: '1.0,2.0': must be 33 finite numbers"),
        (CRAZYSWARM + piece(-1.0), "line 2: duration = -1: must be above 0"),
        (SKYBRUSH + "0,1,2,3,0,0,0\n0,1,2,3,0,0,0\n", "line 3: the time 0 s must be later than 0 s"),
        (SKYBRUSH + "0,1,nan,3,0,0,0\n", "line 2: '0,1,nan,3,0,0,0': must be 7 finite numbers"),
        (TUM + "1 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n", "line 3: the time -1 s must be later than 0 s"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(flockwire: CommandLine, tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "wrong.csv").write_text(text)
    done = flockwire("convert", tmp_path / "wrong.csv", "--out", tmp_path / "out.csv")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert said in done.stderr
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    "content",
    [
        {"show.json": "{}"},
        {"show.json": "[" * 5000},
        {"show.json": '{"swarm": {"drones": [{"settings": {"trajectory": {"$ref": "./lost.json#"}}}]}}'},
        {"show.json": '{"swarm": {"drones": [{"settings": {"trajectory": {"version": 1, "points": []}}}]}}'},
        {"readme.txt": "hello"},
    ],
)
def test_a_wrong_show_is_refused_in_one_line(flockwire: CommandLine, tmp_path: Path, content: dict[str, str]) -> None:
    with zipfile.ZipFile(tmp_path / "wrong.skyc", "w") as archive:
        for name, text in content.items():
            archive.writestr(name, text)
    done = flockwire("convert", tmp_path / "wrong.skyc", "--out", tmp_path / "out.csv")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)

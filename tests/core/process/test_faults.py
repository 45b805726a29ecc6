"""The file of faults: what is taken, and what is refused with one clear line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import load_faults, parse_faults
from flockwire_lab.faults.kinds import Kill, LinkChange

EVERY_KIND = [
    {"at": 1.0, "kind": "kill", "process": "uav3"},
    {"at": 2, "kind": "restart", "process": "uav3"},
    {"at": 2.0, "kind": "freeze", "process": "gateway", "duration": 0.4},
    {"at": 3.0, "kind": "cut", "from": "uav1", "to": "uav2", "duration": 1.0},
    {"at": 4.0, "kind": "link", "from": "gateway", "to": "uav1", "duration": 1.0, "delay": 0.05, "loss": 0.5},
    {"at": 5.0, "kind": "partition", "processes": ["uav3", "uav4"], "duration": 1.0},
    {"at": 6.0, "kind": "tracker", "drone": 2, "duration": 0.5},
    {"at": 7.0, "kind": "noise", "noise": 0.01, "duration": 2.0},
    {"at": 7.5, "kind": "swap", "drones": [1, 3], "duration": 0.5},
    {"at": 7.5, "kind": "visitor", "start": [0, 0, 1], "velocity": [1.0, 0.0, 0.0], "duration": 5.0},
    {"at": 8.0, "kind": "clock", "process": "uav1", "step": -0.02},
    {"at": 9.0, "kind": "lag", "drone": 1, "lag": 0.3, "dead_time": 0.1},
    {"at": 10.0, "kind": "failure", "drone": 4},
    {"at": 11.0, "kind": "false_estimate", "drone": 1, "velocity": [0.1, 0.0, 0.0], "duration": 5.0},
    {"at": 11.0, "kind": "false_age", "drone": 1, "age": 0.0, "duration": 5.0},
    {"at": 11.0, "kind": "false_bids", "drone": 1, "price": 9.0, "duration": 5.0},
    {"at": 11.0, "kind": "false_pose", "drone": 0, "velocity": [0.1, 0.0, 0.0], "duration": 5.0},
    {"at": 11.0, "kind": "false_height", "drone": 1, "offset": -0.5, "duration": 5.0},
]


def test_every_kind_is_read(make_plan: Callable[..., Plan]) -> None:
    faults = parse_faults({"faults": EVERY_KIND}, make_plan(), "f.toml")
    assert [fault.kind for fault in faults] == [table["kind"] for table in EVERY_KIND]
    assert isinstance(faults[0], Kill)
    assert isinstance(faults[4], LinkChange)
    assert (faults[4].source, faults[4].target, faults[4].loss) == ("gateway", "uav1", 0.5)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ({"at": 1.0, "kind": "kill", "process": "uav9"}, "faults.0.process = 'uav9': there is no such process"),
        ({"at": 1.0, "kind": "kill", "process": "recorder"}, "'recorder': there is no such process"),
        (
            {"at": 1.0, "kind": "swap", "drones": [1, 9], "duration": 1.0},
            "faults.0.drones.1 = 9: there is no such drone",
        ),
        (
            {"at": 1.0, "kind": "swap", "drones": [1, 1], "duration": 1.0},
            "faults.0.drones = [1, 1]: must be two drones",
        ),
        ({"at": -1.0, "kind": "kill", "process": "uav1"}, "at = -1.0"),
        ({"at": 1.0, "kind": "explode", "process": "uav1"}, "explode"),
        ({"at": 1.0, "kind": "kill", "process": "uav1", "hard": True}, "hard = true: unknown key"),
        ({"at": 1.0, "kind": "freeze", "process": "uav1"}, "duration: missing"),
        ({"at": 1.0, "kind": "tracker", "drone": 7, "duration": 1.0}, "faults.0.drone = 7: there is no such drone"),
        (
            {"at": 1.0, "kind": "false_age", "drone": 0, "age": 1.0, "duration": 1.0},
            "0.drone = 0: false_age cannot happen to it, by its airframe, part or law; must be one of [1, 2, 3, 4]",
        ),
        (
            {"at": 1.0, "kind": "cut", "from": "uav2", "to": "uav1", "duration": 1.0},
            "faults.0.to = 'uav1': receives nothing from uav2; must be one of gateway, kinematics, uav3",
        ),
        ({"at": 1.0, "kind": "link", "from": "uav1", "to": "uav2", "duration": 1.0, "loss": 2.0}, "loss = 2.0"),
        ({"at": 1.0, "kind": "partition", "processes": ["x"], "duration": 1.0}, "processes.0 = 'x'"),
    ],
)
def test_nonsense_is_refused_in_one_line(make_plan: Callable[..., Plan], fault: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_faults({"faults": [fault]}, make_plan(), "f.toml")
    assert said in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    assert str(caught.value).startswith("f.toml: ")


def test_times_must_be_in_order(make_plan: Callable[..., Plan]) -> None:
    with pytest.raises(InputError, match=r"faults\.1\.at = 2: must not be before .* 3"):
        parse_faults({"faults": [{"at": t, "kind": "kill", "process": "uav1"} for t in (3.0, 2.0)]}, make_plan(), "f")


def test_a_bad_file_is_named(make_plan: Callable[..., Plan], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read the faults"):
        load_faults(tmp_path / "none.toml", make_plan())
    (tmp_path / "bad.toml").write_text("faults = [")
    with pytest.raises(InputError, match="not TOML"):
        load_faults(tmp_path / "bad.toml", make_plan())

"""The file of faults that docs/faults.md names flies, of every kind."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, get_args

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import NOBODY, parse_faults
from flockwire_lab.faults.injection import possible_faults
from flockwire_lab.faults.kinds import Fault
from flockwire_operator.station.fault_injection import unable

ROOT = Path(__file__).parents[2]
FILE = "examples/fault_campaign/every_kind.toml"
PAGE = ROOT / "docs" / "faults.md"
WEARS = {"drones.1.airframe": "multirotor"}
KINDS = {get_args(kind.model_fields["kind"].annotation)[0]: kind for kind in get_args(Fault)}


@pytest.fixture
def tables() -> list[dict[str, Any]]:
    """Return the faults of the file that the page names."""
    assert FILE in PAGE.read_text(encoding="utf-8")
    return tomllib.loads((ROOT / FILE).read_text(encoding="utf-8"))["faults"]


def test_the_file_on_the_page_can_be_read(example: Callable[[str, str], str], make_plan: Callable[..., Plan]) -> None:
    assert parse_faults(tomllib.loads(example("faults", "toml")), make_plan(WEARS), "the page")


def test_of_the_file_of_the_page_a_real_flight_refuses_what_the_page_says(
    make_plan: Callable[..., Plan], tables: list[dict[str, Any]]
) -> None:
    plan = make_plan(WEARS)
    with pytest.raises(InputError) as refused:
        parse_faults({"faults": tables}, plan, "wrong", partial(unable, plan, next(iter(plan.swarm.hosts))))
    keys = [line.partition(": ")[2].partition(" = ")[0].split(".") for line in str(refused.value).split("\n")]
    assert [(tables[int(place)]["kind"], key) for _, place, key in keys] == [
        ("link", "loss"),
        ("link", "reordering"),
        ("clock", "kind"),
    ]
    page = " ".join(PAGE.read_text(encoding="utf-8").split())
    assert "only `sim` can inject: the `clock`, and `loss` and `reordering` of the `link`" in page


def test_it_can_be_injected_into_the_swarm_beside_it(tables: list[dict[str, Any]]) -> None:
    plan = Plan(load_swarm((ROOT / FILE).with_name("swarm.toml")))
    assert len(possible_faults({"faults": tables}, plan, FILE)) == len(tables)


def test_all_mistakes_are_named_at_once(make_plan: Callable[..., Plan], tables: list[dict[str, Any]]) -> None:
    plan = make_plan(WEARS)
    wrong = [*tables, {"at": 20.0, "kind": "tracker", "drone": 9, "duration": 0.4}, {"at": 21.0, "kind": "kil"}]
    with pytest.raises(InputError) as refused:
        parse_faults({"faults": wrong}, plan, "wrong", partial(unable, plan, next(iter(plan.swarm.hosts))))
    named = [line.split(": ")[1].partition(" = ")[0] for line in str(refused.value).split("\n")]
    last = len(tables)
    assert named == [
        f"faults.{last + 1}.kind",
        "faults.3.loss",
        "faults.3.reordering",
        "faults.5.kind",
        f"faults.{last}.drone",
    ]


def test_a_fault_that_no_drone_can_have_says_so(make_plan: Callable[..., Plan]) -> None:
    wear = {"at": 1.0, "kind": "wear", "drone": 1, "mass": 1.1}
    with pytest.raises(InputError) as refused:
        parse_faults({"faults": [wear]}, make_plan(), "wrong.toml")
    assert str(refused.value).endswith(f"by its airframe, part or law; {NOBODY}")


def test_the_file_of_the_page_has_every_kind(tables: list[dict[str, Any]]) -> None:
    assert {table["kind"] for table in tables} == KINDS.keys()


@pytest.mark.long
def test_the_file_of_the_page_flies(tables: list[dict[str, Any]], fly: Callable[..., Any]) -> None:
    flown = fly({"control.law": "extended"} | WEARS, *tables, duration=16.0)
    at = {table["kind"]: table["at"] for table in tables}
    assert all(phase != "landing" for i in (1, 2, 3, 4) for t, phase, _ in flown.phases(f"uav{i}") if t < at["kill"])
    assert flown.of("command", "uav3", at["kill"] - 0.1, at["kill"])
    assert not flown.of("command", "uav3", at["kill"] + 0.01)
    telemetry = flown.of("telemetry", "uav2", at["failure"] + 1.0)
    assert telemetry[0][1].state is FlightState.STOPPED
    assert "left the formation" in flown.outcome.failure

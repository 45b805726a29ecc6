"""The first of lab/bench/order_pairs.py: two stations give an order each, and what goes down holds."""

from __future__ import annotations

from itertools import cycle, product

import pytest
from flockwire_core.domain.order import Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.wire.phase import Phase
from flockwire_lab.world import EPOCH, World
from order_pairs import CASES, SITUATIONS, VERBS, Case, case_of, fly, swarm

DRAWS = {"on the ground": 0, "in take-off": 1, "in the air": 3}  # the draw of each; odd ones on a usual network


@pytest.mark.parametrize(
    ("first", "second", "situation"),
    [(*pair, situation) for pair, situation in zip(product(VERBS[:-1], ("hold", "land")), cycle(SITUATIONS))],
)
def test_what_goes_down_last_holds(first: str, second: str, situation: str) -> None:
    assert fly(Case(first, second, situation, DRAWS[situation])).wrong == ""


@pytest.mark.parametrize(("first", "second"), list(product(("hold", "land"), ("start", "formation"))))
def test_what_takes_up_holds_only_with_knowledge_of_what_it_ends(first: str, second: str) -> None:
    assert fly(Case(first, second, "in the air", 2)).wrong == ""


@pytest.mark.parametrize("situation", SITUATIONS[:2])
def test_two_starts_at_once_are_one(situation: str) -> None:
    assert fly(Case("start", "start", situation, 1)).wrong == ""


def test_a_stop_outranks_all() -> None:
    assert fly(Case("stop", "start", "in the air", 0)).wrong == ""


@pytest.mark.long
@pytest.mark.parametrize("case", list(map(case_of, range(2 * len(CASES)))), ids=str)
def test_all_pairs(case: Case) -> None:
    assert fly(case).wrong == ""


def landed(gap: float) -> tuple[list[str], list[str]]:
    """Start on the ground by one station, land by another `gap` s later; returns the phases and the answers."""
    world = World(swarm(), 0, 0.0, stations=("console",))
    world.conduct(None)
    for station, verb, at in (("operator", "start", 3.0), ("console", "land", 3.0 + gap)):
        order = Order(verb)
        world.scheduler.at(
            EPOCH + nanoseconds(at), lambda _, station=station, order=order: world.station(station).ask(order)
        )
    world.scheduler.run(EPOCH + 20 * SECOND)
    fleet = world.station().core.fleet(world.scheduler.now)
    given = [world.station(name).answers[0][1] for name in ("operator", "console")]
    return [str(fleet.phase(drone)) for drone in fleet.pilots], [answer.refusal for answer in given]


@pytest.mark.parametrize("gap", [0.02, 0.3, 1.0])
def test_a_start_beside_a_landing_reports_it(gap: float) -> None:
    phases, refusals = landed(gap)
    assert phases == [Phase.READY] * 3
    assert refusals == ["land was ordered meanwhile", ""]

"""Flights whose followers share the places out among themselves: lost bids, restarts, landings, changes, a liar."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from math import dist
from random import Random
from typing import Any

import numpy as np
import pytest
from flockwire_agent.place_auction import most_cost
from flockwire_analysis.checks import ABOUT_THE_RECORD
from flockwire_analysis.phases import offsets, shared_places
from flockwire_analysis.recorded import Held, Trace
from flockwire_analysis.summary import summarise
from flockwire_analysis.tracking import formation_errors, interpolated
from flockwire_core.control.assignment import least_cost
from flockwire_core.control.auction import TOLERANCE, Bid, bids_of, held_place, highest_price
from flockwire_core.domain.order import Mission, Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.law_form import LawForm
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.flight import Flight, TraceInMemory, fly_in_memory
from flockwire_lab.world import EPOCH, World

FOLLOWERS = (1, 2, 3, 4)
STARTS = ((0.0, 0.0), (0.6, -2.3), (-2.8, 0.9), (-0.7, 2.6), (2.9, -0.8))  # none near the place of its rank
BOTH_WAYS = [[0, 1], [1, 2], [2, 1], [2, 3], [3, 2], [3, 4], [4, 3]]
AUCTION = {
    "control.law": "extended",
    "graph.edges": BOTH_WAYS,
    "formation": {"kind": "circle", "radius": 1.5, "rate": 0.2, "assignment": "auction"},
}


def bids(flown: Any, i: int, begin: float = -99.0, end: float = 1e9) -> list[tuple[tuple[int, int], list[Bid]]]:
    """Return the bids that a follower published between two moments, each with its order."""
    form = LawForm(bids_of(len(FOLLOWERS)))
    told = [form.unpack(data) for _, law in flown.of("law", uav(i), begin, end) for _, data in law.contents]
    return [((one.stamp, one.giver), [Bid(*bid) for bid in zip(one.prices, one.bidders, strict=True)]) for one in told]


def places(flown: Any, begin: float = -99.0, end: float = 1e9) -> dict[int, list[int | None]]:
    """Return the places that each follower held between two moments, in turn."""
    found: dict[int, list[int | None]] = {}
    for i in FOLLOWERS:
        held = [held_place(one, i) for _, one in bids(flown, i, begin, end)]
        found[i] = [place for k, place in enumerate(held) if not k or place != held[k - 1]]
    return found


def costs_of(trace: Trace, order: Mission) -> list[list[float]]:
    """Return the squared distance of each follower, at an order without a change, from each place, m^2."""
    formation = trace.swarm.build_formation(order.formation)
    at = np.array([order.stamp])
    leader, costs = interpolated(trace.positions(0), at)[0], []
    for follower in trace.swarm.followers:
        here = interpolated(trace.positions(follower), at)[0] - leader
        costs.append([dist(here, formation.offset(rank, 0.0)) ** 2 for rank in range(formation.count)])
    return costs


def on_a_tree(count: int) -> Swarm:
    """Return a swarm on a random tree, both ways, with random starts 1 m apart; 20 % of all messages are lost."""
    chance, starts = Random("auction 4"), [(0.0, 0.0)]
    while len(starts) <= count:
        place = (round(8.0 * (chance.random() - 0.5), 2), round(8.0 * (chance.random() - 0.5), 2))
        if all(dist(place, other) >= 1.0 for other in starts):
            starts.append(place)
    pairs = [[chance.randrange(1, i), i] for i in range(2, count + 1)]
    table = {
        "name": "auction",
        "control": {"law": "extended"},
        "formation": {"kind": "circle", "radius": 2.5, "assignment": "auction"},
        "leader": {"trajectory": {"kind": "constant", "velocity": [0.1, 0.05, 0.0]}},
        "graph": {"edges": [[0, 1], *pairs, *([b, a] for a, b in pairs)]},
        "sim": {"loss": 0.2},
        "drones": [{"id": i, "start": [*place, 0.0]} for i, place in enumerate(starts)],
    }
    return parse_swarm(table, "drawn")


@pytest.mark.long
def test_eight_followers_on_a_tree_agree_in_spite_of_lost_bids() -> None:
    swarm = on_a_tree(8)
    _, trace = fly_in_memory(Flight(swarm, 4, 16.0), lambda _: None)
    checks = summarise(trace).checks
    assert [check.sentence() for check in checks if not check.ok and check.name not in ABOUT_THE_RECORD] == []
    start = next(order for order in trace.missions if order.verb == "start")
    held = [[one for one in trace.held[i] if one.order == start.version][-1] for i in swarm.followers]
    assert sorted(one.place for one in held) == list(range(8))
    assert max(one.stamp - start.stamp for one in held) < 3 * SECOND
    costs = costs_of(trace, start)
    optimum = sum(costs[i][j] for i, j in enumerate(least_cost(costs)))
    assert sum(row[one.place] for row, one in zip(costs, held, strict=True)) <= (1.0 + TOLERANCE) * optimum


@pytest.fixture(scope="module")
def settled(make_swarm: Callable[..., Any]) -> Trace:
    """Return a flight from starts that are not near the places of their ranks."""
    elsewhere = {f"drones.{i}.start": [*start, 0.0] for i, start in enumerate(STARTS)}
    swarm = make_swarm(AUCTION | elsewhere | {"checks.settle_within": 3.0})
    return fly_in_memory(Flight(swarm, 0, 8.0), lambda _: None)[1]


def test_the_summary_judges_each_follower_by_the_place_that_it_holds(settled: Trace) -> None:
    trace, swarm = settled, settled.swarm
    start = next(order for order in trace.missions if order.verb == "start")
    held = {i: trace.held[i][-1].place for i in FOLLOWERS}
    assert held != {i: i - 1 for i in FOLLOWERS}  # else any place would do
    best = costs_of(trace, start)
    assert sum(best[i - 1][held[i]] for i in FOLLOWERS) < sum(best[i - 1][i - 1] for i in FOLLOWERS)
    late = start.start + 3 * SECOND
    for i in FOLLOWERS:
        expected = swarm.build_formation().offset(held[i], 3.0)
        assert dist(offsets(trace, i, np.array([late]))[0], expected) < 1e-9
    summary = summarise(trace)
    assert not [check.sentence() for check in summary.checks if not check.ok]
    assert summary.formation_error_m.max_tail < 0.01


def test_two_with_one_place_fail_the_check_of_places(settled: Trace) -> None:
    trace = settled
    start = next(order for order in trace.missions if order.verb == "start")
    shared = replace(trace, held={**trace.held, 2: (Held(start.stamp, start.version, trace.held[4][-1].place),)})
    assert shared_places(trace, 3.0) == ()
    assert shared_places(shared, 3.0) == (f"uav2 and uav4 both hold place {trace.held[4][-1].place}",)
    assert shared_places(shared, 30.0) == ()  # so short a phase may end before its auction
    (found,) = (check for check in summarise(shared).checks if check.name == "places")
    assert not found.ok


@pytest.fixture(scope="module")
def restarted(fly: Callable[..., Any]) -> Any:
    """Return a flight in which uav2 is restarted after all have their places."""
    return fly(AUCTION, {"at": 6.0, "kind": "restart", "process": "uav2"}, duration=11.0)


def test_commands_keep_to_the_acceleration_while_places_change(restarted: Any) -> None:
    flown = restarted
    limit, speed = flown.world.swarm.limits.acceleration, flown.world.swarm.limits.speed
    for i in FOLLOWERS:
        commands = [(t, m.velocity) for t, m in flown.of("command", uav(i), 1.0, 6.0)]
        assert max(dist(v, (0.0, 0.0, 0.0)) for _, v in commands) <= speed + 1e-6
        for (s, u), (t, v) in pairwise(commands):
            assert dist(u, v) <= limit * (t - s) + 0.02


def test_who_restarts_in_flight_finds_its_place_and_nobody_else_moves(restarted: Any) -> None:
    flown = restarted
    before, after = places(flown, 0.0, 6.0), places(flown, 6.0)
    final = {i: before[i][-1] for i in FOLLOWERS}
    assert sorted(final.values()) == [0, 1, 2, 3]
    assert after[2][-1] == final[2]
    assert {i: after[i] for i in (1, 3, 4)} == {i: [final[i]] for i in (1, 3, 4)}
    reports = [status.report for _, status in flown.of("status", "uav2", 10.0)]
    assert reports[0].place == final[2]
    assert 0.0 <= reports[0].formation_error < 0.05
    assert flown.outcome.failure == ""


@pytest.mark.long
def test_who_restarts_and_hears_nobody_is_judged_by_the_place_that_it_held(make_swarm: Callable[..., Any]) -> None:
    swarm = make_swarm(AUCTION)
    cuts = [{"at": 6.0, "kind": "cut", "from": one, "to": "uav2", "duration": 8.0} for one in ("uav1", "uav3")]
    faults = [*cuts, {"at": 6.2, "kind": "restart", "process": "uav2"}]
    trace = TraceInMemory(swarm, 0)
    World(swarm, 0, 14.0, parse_faults({"faults": faults}, Plan(swarm), "test"), trace.take).run()
    found = trace.trace()
    start = next(order for order in found.missions if order.verb == "start")
    held = [one.place for one in found.held[2] if one.order == start.version]
    assert held[-1] is not None
    assert [a for a, b in pairwise(held) if a == b] == []
    assert any("holds no place yet" in shown.why for shown in found.shown["uav2"][-20:])
    assert [check.name for check in summarise(found).checks if check.name == "formation tail" and not check.ok]


def test_the_place_of_a_drone_that_falls_stays_taken_until_the_next_order(fly: Callable[..., Any]) -> None:
    flown = fly(AUCTION, {"at": 6.0, "kind": "failure", "drone": 3}, duration=8.0)
    final = {i: held[-1] for i, held in places(flown, 0.0, 6.0).items()}
    assert all(set(held) == {final[i]} for i, held in places(flown, 6.0).items() if held)


def test_places_of_drones_left_out_stay_empty(make_swarm: Callable[..., Any]) -> None:
    swarm = make_swarm(AUCTION)
    _, trace = fly_in_memory(Flight(swarm, 0, 6.0, without=(4,)), lambda _: None)
    assert sorted(trace.held[i][-1].place for i in (1, 2, 3)) == [0, 1, 2]
    assert not [check.sentence() for check in summarise(trace).checks if not check.ok]


def test_who_lost_its_pose_before_the_order_still_passes_bids_on(fly: Callable[..., Any]) -> None:
    def interrupt(world: World) -> None:
        for at, verb in ((5.0, "hold"), (6.5, "resume")):
            world.scheduler.at(EPOCH + nanoseconds(at), lambda _, verb=verb: by_director(world, verb))

    unseen = {"at": 6.0, "kind": "tracker", "drone": 2, "duration": 9.0}
    flown = fly(AUCTION, unseen, duration=10.0, prepare=interrupt)
    last = {i: bids(flown, i)[-1] for i in FOLLOWERS}
    assert len({order for order, _ in last.values()}) == 1
    assert {held_place(last[4][1], 1), held_place(last[1][1], 4)}.isdisjoint({None})


def by_director(world: World, verb: str) -> None:
    """Order `verb` now, as the station that conducts the flight."""
    world.station().core.order(verb, world.scheduler.now)


CHANGES = {
    **AUCTION,
    "formations": {
        "row": {"kind": "line", "spacing": 0.9, "heading": 1.0},
        "block": {"kind": "grid", "spacing": 1.0, "assignment": "auction"},
    },
}


@pytest.fixture(scope="module")
def changed(make_swarm: Callable[..., Any]) -> tuple[Any, list[Any]]:
    """Fly from a circle by auction to a row, then to a grid by auction, hold, and go on; return trace and answers."""
    swarm = make_swarm(CHANGES)
    trace = TraceInMemory(swarm, 0)
    world = World(swarm, 0, 22.0, (), trace.take)
    orders = {6.0: Order("formation", "row"), 11.0: Order("formation", "block")}
    for at, order in orders.items():
        world.scheduler.at(EPOCH + nanoseconds(at), lambda _, order=order: world.station().ask(order))
    for at, verb in ((16.0, "hold"), (17.5, "resume")):
        world.scheduler.at(EPOCH + nanoseconds(at), lambda _, verb=verb: by_director(world, verb))
    outcome = world.run()
    assert outcome.failure == ""
    return trace.trace(), [answer for _, answer in world.station().answers]


def test_formations_change_from_and_to_an_auction(changed: tuple[Any, list[Any]]) -> None:
    trace, answers = changed
    assert [answer.refusal for answer in answers] == ["", ""]
    assert "the followers' auction decides" not in answers[0].note
    assert "rehearsed with the best places, the followers' auction decides" in answers[1].note
    start, row, block = [order for order in trace.missions if order.verb in ("start", "formation")][:3]
    held = {i: [one for one in trace.held[i] if one.order == start.version][-1].place for i in FOLLOWERS}
    assert row.change.places_before == tuple(held[i] for i in FOLLOWERS)
    assert block.change.places_before == row.change.places
    last = [[one for one in trace.held[i] if one.order == block.version][-1].place for i in FOLLOWERS]
    assert sorted(last) == [0, 1, 2, 3]
    assert not [check.sentence() for check in summarise(trace).checks if not check.ok]


def test_drones_keep_their_places_all_along_both_changes(changed: tuple[Any, list[Any]]) -> None:
    trace, _ = changed
    for order in trace.missions:
        if order.change is None:
            continue
        begin, end = order.change.begin - SECOND // 2, order.change.begin + nanoseconds(order.change.duration)
        for errors in formation_errors(trace).values():
            within = (errors.stamps >= begin) & (errors.stamps <= end)
            assert errors.values[within].max() < 0.06


@pytest.mark.long
@pytest.mark.parametrize("at", [0.0, 7.0])
def test_a_liar_that_claims_all_places_keeps_drones_where_they_are_until_the_next_order(
    make_swarm: Callable[..., Any], at: float
) -> None:
    swarm = make_swarm(AUCTION)
    price = highest_price(4, most_cost(swarm))
    lie = {"at": at, "kind": "false_bids", "drone": 2, "price": price, "duration": 9.0 - at}
    trace = TraceInMemory(swarm, 0)
    world = World(swarm, 0, 18.0, parse_faults({"faults": [lie]}, Plan(swarm), "test"), trace.take)
    for when, verb in ((11.0, "hold"), (12.0, "resume")):
        world.scheduler.at(EPOCH + nanoseconds(when), lambda _, verb=verb: by_director(world, verb))
    assert world.run().failure == ""
    found = trace.trace()
    first, _, second = found.missions[1:4]
    for i in (1, 3, 4):
        held = [one.place for one in found.held[i] if one.order == first.version]
        assert held[-1] is None
        waits = found.of("truth", i)
        still = waits.values[(waits.stamps > second.stamp - 3 * SECOND) & (waits.stamps < second.stamp)]
        assert abs(still - still[0]).max() < 0.05
        assert any("holds no place yet" in shown.why for shown in found.shown[uav(i)])
    last = [[one.place for one in found.held[i] if one.order == second.version][-1] for i in FOLLOWERS]
    assert sorted(last) == [0, 1, 2, 3]
    summary = summarise(found)
    assert "formation tail" in {check.name for check in summary.checks if not check.ok}
    assert summary.min_distance_uav_m >= swarm.avoidance.drone_safety_distance

"""A follower that was taken over claims in its status to obey an order that nobody gave: nobody else obeys it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from flockwire_core.domain.order import Change, Mission, Order, Version
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.director import Stage
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report
from flockwire_lab.world import EPOCH, World
from order_pairs import swarm

pytestmark = pytest.mark.sources  # it replaces methods of compiled classes

LIAR = "uav1"
LARGEST = (1 << 31) - 1  # the largest number of a giver: it wins over every rival
BEGIN = 9.0  # s, when the lie begins: all fly the formation
Forged = Callable[[Mission], Mission]


def phase(order: Mission) -> Mission:
    return order._replace(start=order.start - 20 * SECOND, number=order.number + 1)


def formation(order: Mission) -> Mission:
    change = Change(order.stamp, 4.0, "", (0, 1), (1, 0))
    return order._replace(verb="formation", formation="wide", change=change, number=order.number + 1)


def rival(order: Mission) -> Mission:
    return order._replace(start=order.start - 20 * SECOND)


def landing(order: Mission) -> Mission:
    return order._replace(verb="land", start=0, formation="", number=0)


def hold(order: Mission) -> Mission:
    return order._replace(verb="hold", number=0)


def same_version(order: Mission) -> Mission:
    return phase(order)


class Liar:
    """Replaces the order in the reports of one agent, from BEGIN on."""

    def __init__(self, world: World, forged: Forged, claimed: Phase | None = None) -> None:
        self.forged: Mission | None = None
        self.unnumbered: tuple[Version, ...] = ()
        process, make = world.processes[LIAR], world.processes[LIAR]._make_core

        def lying(now: int, starts: int) -> Any:
            core = make(now, starts)
            honest = core.report

            def report(now: int) -> Report:
                truth = honest(now)
                if now < EPOCH + nanoseconds(BEGIN) or truth.mission is None:
                    return truth
                if self.forged is None:
                    self.forged = forged(truth.mission)
                    if forged is not same_version:
                        self.forged = self.forged._replace(stamp=now, giver=LARGEST)
                    self.unnumbered = () if self.forged.number else (self.forged.version,)
                return truth._replace(
                    mission=self.forged, order_age=0.0, unnumbered=self.unnumbered, phase=claimed or truth.phase,
                )  # fmt: skip

            core.report = report  # type: ignore[method-assign]
            return core

        process._make_core = lying


class Obeyed:
    """The orders that the honest pilots and the gateway report, and the orders that stations publish."""

    def __init__(self) -> None:
        self.reported: set[Mission | None] = set()
        self.published: set[Mission] = set()
        self.phases: dict[str, str] = {}

    def __call__(self, published: Any) -> None:
        message, owner = published.message, published.key.owner
        if published.key.kind == "status" and owner in ("leader", "uav2", "gateway"):
            self.reported.add(message.report.mission)
            self.phases[owner] = message.report.phase
        elif published.key.kind == "mission":
            self.published.add(message)


def flown(forged: Forged, seconds: float = 20.0, claimed: Phase | None = None) -> tuple[World, Obeyed, Liar]:
    obeyed = Obeyed()
    world = World(swarm(), 0, 0.0, tap=obeyed, stations=("console",))
    liar = Liar(world, forged, claimed)
    world.scheduler.run(EPOCH + nanoseconds(seconds))
    return world, obeyed, liar


SHOWN_WITH_A_STATION = (pytest.param(forged, marks=pytest.mark.long) for forged in (phase, formation, rival, hold))


@pytest.mark.parametrize("forged", [landing, same_version, *SHOWN_WITH_A_STATION])
def test_nobody_obeys_the_order_that_a_follower_only_claims_to_obey(forged: Forged) -> None:
    world, obeyed, liar = flown(forged)
    assert liar.forged is not None
    spread = {(order.verb, order.start, order.formation) for order in obeyed.published}
    assert (liar.forged.verb, liar.forged.start, liar.forged.formation) not in spread
    assert liar.forged.version not in {one.version for one in obeyed.reported if one} or forged is same_version
    assert liar.forged not in obeyed.reported
    assert world.director.stage is Stage.FLYING
    assert {obeyed.phases[name] for name in ("leader", "uav2")} == {Phase.FORMATION}


def test_a_follower_that_claims_to_land_ends_the_flight_as_one_that_was_lost() -> None:
    world, obeyed, liar = flown(landing, claimed=Phase.LANDING)
    assert liar.forged is not None
    assert liar.forged.version not in {order.version for order in obeyed.published}
    assert world.director.failure.startswith(f"{LIAR} left the formation")


@pytest.mark.parametrize("forged", [phase, formation, rival, hold, landing])
def test_an_order_of_another_station_is_not_made_from_what_a_follower_claims(forged: Forged) -> None:
    obeyed = Obeyed()
    world = World(swarm(), 0, 0.0, tap=obeyed, stations=("console",))
    liar = Liar(world, forged)
    asked = EPOCH + nanoseconds(BEGIN + 3.0)
    world.scheduler.at(asked, lambda _: world.station("console").ask(Order("formation", "wide")))
    world.scheduler.run(EPOCH + nanoseconds(BEGIN + 20.0))
    honest = {order.start for order in obeyed.published if order.verb == "start"}
    wide = {order.start for order in obeyed.published if order.formation == "wide"}
    assert liar.forged is not None
    assert wide == honest
    assert liar.forged not in obeyed.reported
    assert (liar.forged.stamp, liar.forged.giver) not in {order.version for order in obeyed.published}
    assert {obeyed.phases[name] for name in ("leader", "uav2")} == {Phase.FORMATION}

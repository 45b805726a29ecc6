"""Changes of formation at awkward moments."""

from __future__ import annotations

import pytest
from flockwire_core.domain.order import Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.director import Director, Stage
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.formation_planning import plan_change
from flockwire_lab.world import EPOCH

FORMATIONS = {"control.law": "extended", "formations": {"row": {"kind": "line", "spacing": 0.9, "heading": 1.0}}}


class Script(Director):
    """Gives the orders of `script`: at s after the formation's time 0, a function of director, statuses and now."""

    def __init__(self, plan, duration, script):
        super().__init__(plan, Order("start"), 0, EPOCH, Fleet({}, {}, {}, EPOCH), duration)
        self.script = sorted(script.items())

    def step(self, fleet):
        order, started = super().step(fleet), self._known.started
        if order is None and self.stage is Stage.FLYING and self.script and started is not None:
            at, action = self.script[0]
            if fleet.now >= started.start + nanoseconds(at):
                self.script.pop(0)
                order = action(self, fleet)
        return order


def to(name):
    """Return what changes to the formation `name` as an operator that has just come does: from the statuses alone."""

    def change(director, fleet):
        missions = [status.report.mission for status in fleet.fresh.values() if status.report.mission is not None]
        running = max(missions, key=lambda mission: (mission.stamp, mission.start))
        order = plan_change(director.swarm, running, name, fleet.now, fleet.fresh[0].report.position)
        return director._go(Stage.FLYING, order)

    return change


RESTART = 10.6  # s after take-off


@pytest.fixture(scope="module")
def flown(fly, make_plan):
    """Fly into a row, hold, and go back while one pilot is restarted."""
    plan = make_plan(FORMATIONS)
    hold = lambda director, fleet: director.hold(fleet.now)  # noqa: E731
    director = Script(plan, 14.0, {3.0: to("row"), 6.0: hold, 7.0: to("")})
    director.swarm = plan.swarm
    found = fly(
        FORMATIONS, {"at": RESTART, "kind": "restart", "process": "uav2"}, prepare=lambda world: world.conduct(director)
    )
    assert found.outcome.failure == ""
    assert director.script == []
    return found


def test_orders_of_changes_arrive_as_their_bytes_say(flown):
    assert flown.differing() == {}


def times(flown, verb):
    """Return when, s after take-off, each change began and ended."""
    orders = {order: t for t, order in reversed(flown.of("mission", "")) if order.verb == verb}
    return [
        (t + (order.change.begin - order.stamp) / SECOND, order.change.duration)
        for order, t in sorted(orders.items(), key=lambda item: item[1])
    ]


def errors(flown, begin, end):
    """Return the formation errors that the followers reported between two moments after take-off."""
    return [
        status.report.formation_error
        for i in range(1, 5)
        for _, status in flown.of("status", f"uav{i}", begin, end)
        if status.report.phase == "formation"
    ]


def test_drones_keep_their_places_all_along_a_change(flown):
    (begin, duration), _ = times(flown, "formation")
    assert max(errors(flown, begin - 0.5, begin + duration + 0.5)) < 0.05


def test_a_formation_changes_right_after_a_hold(flown):
    verbs = [order.verb for _, order in flown.of("mission", "")]
    assert verbs.index("hold") < len(verbs) - 1 - verbs[::-1].index("formation")
    _, (begin, _) = times(flown, "formation")
    assert max(errors(flown, begin + 3.5, 13.9)) < 0.05


def test_a_pilot_that_is_restarted_in_a_change_continues_with_it(flown):
    _, (begin, duration) = times(flown, "formation")
    assert begin < RESTART < begin + duration
    phases = [phase for t, phase, _ in flown.phases("uav2", RESTART) if t < 14.0]
    assert phases[-1] == "formation"

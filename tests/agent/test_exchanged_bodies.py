"""A pose that may be another drone's, because names may have been exchanged while nobody looked."""

import pytest
from flockwire.domain.airframe import FlightState
from flockwire.domain.time import SECOND
from flockwire.domain.vector import add, scale
from flockwire.wire.phase import Phase
from flockwire.wire.status import APART

SLOW = {"formation.rate": 0.001, "limits.speed": 1.5}
STILL = (0.0, 0.0, 0.0)


@pytest.fixture(params=["extended", "paper"])
def flyer(cockpit, request):
    """Return an agent in formation that flies where it is commanded."""
    agent = cockpit(SLOW | {"control.law": request.param}).fly()
    agent.holds_still = False
    return agent


@pytest.fixture(params=["extended", "paper"])
def restarted(cockpit, request):
    """Return an agent whose process was started while its drone flies, 1 m up; it obeys a start."""
    agent = cockpit(SLOW | {"control.law": request.param})
    agent.state, agent.position = FlightState.FLYING, (3.0, 0.0, 1.0)
    agent.run(0.1)
    assert agent.phase is Phase.HOLD
    agent.order("start", agent.now)
    agent.step()
    assert agent.phase is Phase.FORMATION
    return agent


def exchange(agent, seconds, *, answer):
    """Let the pose move at `answer` times the command for `seconds`, until the agent lands."""
    agent.holds_still = True
    for _ in range(round(100 * seconds)):
        agent.step()
        if agent.phase is Phase.LANDING:
            return
        x, y, _ = scale(agent.velocity, 0.01 * answer)
        agent.position = add(agent.position, (x, y, 0.0))


def test_a_pose_that_cannot_be_its_own_after_a_time_without_poses_is_not_used(flyer):
    flyer.silent = {"pose", "nearby"}
    flyer.run(0.6)
    flyer.silent.clear()
    flyer.position = add(flyer.position, (2.0, 0.0, 0.0))
    for _ in range(495):
        flyer.step()
        assert (flyer.phase, flyer.velocity) == (Phase.HOLD, STILL)
    assert flyer.report.detail == "the tracker confuses its body with another"
    flyer.run(0.2)
    assert (flyer.phase, flyer.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))
    flyer.run(2.0)
    assert flyer.phase in (Phase.GROUNDED, Phase.READY)
    flyer.run(0.2)
    assert flyer.phase is Phase.READY


@pytest.mark.parametrize("absence", [0.35, 0.9])
def test_a_drone_that_the_wind_moved_meanwhile_continues(flyer, absence):
    flyer.silent = {"pose"}
    flyer.run(absence)
    flyer.silent.clear()
    flyer.position = add(flyer.position, (1.5 * absence, 0.0, 0.0))
    flyer.run(0.1)
    assert flyer.phase is Phase.FORMATION


@pytest.mark.parametrize("answer", [-1.0, 0.0])
def test_a_pilot_that_restarts_and_follows_anothers_pose_lands_soon(restarted, answer):
    restarted.leader = (9.0, 0.0, 1.0)
    exchange(restarted, 3.0, answer=answer)
    assert restarted.phase is Phase.LANDING
    assert restarted.report.detail.startswith("its tracked body moves ")
    assert [reason.code for reason in restarted.report.reasons] == [APART]
    restarted.step()
    assert restarted.velocity == (0.0, 0.0, -0.7)


def test_a_pilot_that_restarts_and_sees_anothers_landing_lands(cockpit):
    agent = cockpit(SLOW)
    agent.state, agent.position = FlightState.FLYING, (3.0, 0.0, 1.0)
    agent.run(0.5)
    agent.holds_still, agent.height = True, 1.0
    for _ in range(150):
        x, y, z = agent.position
        agent.position = (x, y, z - 0.007)
        agent.step()
    assert agent.phase is Phase.LANDING


def test_a_pilot_that_restarts_and_sees_its_own_body_flies_on(restarted):
    restarted.leader = (12.0, 0.0, 1.0)
    restarted.run(8.0)
    assert restarted.phase is Phase.FORMATION
    assert restarted.core._pilot._body.watched is False


@pytest.mark.parametrize(("obeys_after", "phase"), [(1.5, Phase.FORMATION), (9.0, Phase.LANDING)])
def test_a_drone_that_lost_its_pose_in_the_take_off_may_obey_late(cockpit, obeys_after, phase):
    agent = cockpit(SLOW | {"control.law": "paper"})
    agent.run(0.1)
    agent.order("takeoff")
    agent.run(0.5)
    agent.silent = {"pose", "nearby"}
    agent.run(0.5)
    agent.silent.clear()
    agent.run(1.5)
    assert agent.phase is Phase.HOLD
    agent.order("start", agent.now)
    agent.leader, agent.holds_still = (9.0, 0.0, 1.0), True
    agent.run(obeys_after)
    agent.holds_still = False
    agent.run(0.1)
    assert agent.phase is phase


def test_a_drone_that_lost_its_pose_just_after_the_take_off_may_obey_late(cockpit):
    agent = cockpit(SLOW | {"control.law": "paper"})
    agent.run(0.1)
    agent.order("takeoff")
    while agent.phase is not Phase.HOLD:
        agent.step()
    agent.silent = {"pose", "nearby"}
    agent.run(0.35)
    agent.silent.clear()
    agent.run(0.02)
    agent.order("start", agent.now)
    agent.leader, agent.holds_still = (9.0, 0.0, 1.0), True
    agent.run(1.5)
    agent.holds_still = False
    agent.run(0.1)
    assert agent.phase is Phase.FORMATION


def test_a_height_is_not_compared_with_an_old_telemetry(restarted):
    restarted.run(0.5)
    restarted.leader, restarted.silent = (0.0, 0.0, 4.0), {"telemetry"}
    restarted.run(2.0)
    assert restarted.position[2] > 2.0
    assert restarted.phase is Phase.FORMATION
    restarted.silent.clear()
    restarted.run(2.0)
    assert restarted.phase is Phase.FORMATION


def test_an_absence_in_which_the_clock_is_set_back_is_one(flyer):
    """A gateway that restarts with another clock sets back that of its pilots."""
    flyer.silent = {"pose", "nearby"}
    flyer.run(0.6)
    flyer.now -= 3600 * SECOND
    flyer.step()
    flyer.silent.clear()
    flyer.run(0.1)
    flyer.position = add(flyer.position, (0.3, 0.0, 0.0))
    exchange(flyer, 3.0, answer=-1.0)
    assert flyer.phase is Phase.LANDING
    assert flyer.report.detail.startswith("its tracked body moves ")


def test_one_that_is_not_examined_may_be_pushed(flyer):
    flyer.leader = (9.0, 0.0, 1.0)
    exchange(flyer, 2.0, answer=0.0)
    assert flyer.phase is Phase.FORMATION


def test_an_examined_drone_that_lands_is_examined_no_more(restarted):
    restarted.order("land")
    restarted.run(3.0)
    assert restarted.phase in (Phase.GROUNDED, Phase.READY)
    assert restarted.core._pilot._body.watched is False

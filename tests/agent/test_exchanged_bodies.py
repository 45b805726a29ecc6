"""A pose that is another drone's, or nobody's: it is not used, and the drone lands by what is left."""

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.vector import add, scale
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import APART

SLOW = {"formation.rate": 0.001, "limits.speed": 3.0}
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
    """Let the pose move at `answer` times the command for `seconds`, until the agent knows."""
    agent.holds_still, agent.command_age = True, 0.0
    for _ in range(round(100 * seconds)):
        agent.step()
        if agent.report.reasons:
            return
        x, y, _ = scale(agent.velocity, 0.01 * answer)
        agent.position = add(agent.position, (x, y, 0.0))


def test_a_pose_that_cannot_be_its_own_is_not_used_and_it_hovers_then_lands(flyer):
    flyer.position = add(flyer.position, (2.0, 0.0, 0.0))
    flyer.run(0.15)
    for _ in range(80):
        flyer.step()
        assert (flyer.phase, flyer.velocity) == (Phase.HOLD, STILL)
    (reason,) = flyer.report.reasons
    assert (reason.code, "jumped by 2.0" in reason.text) == (APART, True)
    flyer.run(0.2)
    assert (flyer.phase, flyer.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))
    flyer.run(3.0)
    assert flyer.phase is Phase.READY
    assert flyer.report.reasons == ()


def test_bodies_that_are_seen_from_a_false_pose_are_not_avoided(flyer):
    flyer.run(1.0)
    before = flyer.velocity
    flyer.position, flyer.bodies = (0.0, 0.0, 0.0), (Body(BodyKind.DRONE, (0.1, 0.0, 0.0), 0.0),)
    flyer.step()
    assert flyer.velocity == pytest.approx(before, abs=0.05)


def test_poses_that_are_its_own_again_soon_are_used(flyer):
    there = flyer.position
    flyer.position = add(there, (2.0, 0.0, 0.0))
    flyer.holds_still = True
    flyer.run(0.14)
    flyer.position = there
    flyer.run(0.1)
    assert (flyer.phase, flyer.report.reasons) == (Phase.FORMATION, ())
    assert dict(flyer.report.counts)["poses refused"] == 14


@pytest.mark.parametrize("absence", [0.35, 0.9])
def test_a_drone_that_the_wind_moved_while_it_was_not_seen_continues(flyer, absence):
    flyer.silent = {"pose"}
    flyer.run(absence)
    flyer.silent.clear()
    flyer.position = add(flyer.position, (1.5 * absence, 0.0, 0.0))
    flyer.run(0.1)
    assert flyer.phase is Phase.FORMATION


def test_a_pilot_that_restarts_and_follows_anothers_pose_lands_soon(restarted):
    restarted.leader = (9.0, 0.0, 1.0)
    exchange(restarted, 5.0, answer=-1.0)
    (reason,) = restarted.report.reasons
    assert (reason.code, "apart from its commands" in reason.text) == (APART, True)
    restarted.run(1.2)
    assert (restarted.phase, restarted.velocity) == (Phase.LANDING, (0.0, 0.0, -0.7))


def test_a_pilot_whose_pose_stands_still_bit_for_bit_lands_soon(restarted):
    restarted.leader = (9.0, 0.0, 1.0)
    restarted.run(3.0)
    exchange(restarted, 1.0, answer=0.0)
    (reason,) = restarted.report.reasons
    assert (reason.code, "stands still" in reason.text) == (APART, True)


def test_a_pilot_that_sees_anothers_landing_lands(cockpit):
    agent = cockpit(SLOW)
    agent.state, agent.position = FlightState.FLYING, (3.0, 0.0, 1.0)
    agent.run(0.5)
    agent.holds_still, agent.height = True, 1.0
    for _ in range(250):
        x, y, z = agent.position
        agent.position = (x, y, max(0.05, z - 0.007))
        agent.step()
    assert (agent.phase, [reason.code for reason in agent.report.reasons]) == (Phase.LANDING, [APART])


def test_a_pilot_that_restarts_and_sees_its_own_body_flies_on(restarted):
    restarted.leader = (5.0, 0.0, 1.0)
    restarted.run(8.0)
    assert (restarted.phase, restarted.report.reasons) == (Phase.FORMATION, ())


@pytest.mark.parametrize("law", ["extended", "paper"])
def test_a_drone_that_takes_off_by_itself_may_obey_late(cockpit, law):
    agent = cockpit(SLOW | {"control.law": law})
    agent.run(0.1)
    agent.order("takeoff")
    while agent.phase is not Phase.HOLD:
        agent.step()
    agent.order("start", agent.now)
    agent.leader, agent.holds_still, agent.command_age = (9.0, 0.0, 1.0), True, 0.0
    agent.run(1.8)
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


def test_one_whose_driver_obeys_no_command_may_be_pushed(flyer):
    flyer.leader, flyer.command_age = (9.0, 0.0, 1.0), 1.0
    flyer.holds_still = True
    flyer.run(2.0)
    assert flyer.phase is Phase.FORMATION

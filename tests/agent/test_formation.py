"""All agents of a swarm, their messages handed over by hand, on ideal airframes."""

from math import dist
from random import Random

import pytest
from flockwire_agent.core import AgentCore
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.body import Nearby
from flockwire_core.domain.motion import Estimate
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import add, scale
from flockwire_core.process.cores import Start
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan

BEGAN = 1_790_000_000 * SECOND


def fly(swarm, seconds):
    """Fly from the air; returns the followers' positions, the leader's, and the agents' reports."""
    plan = Plan(swarm)
    agents = {i: AgentCore(Start(plan, uav(i), BEGAN, Random(0))) for i in swarm.followers}
    places = {i: (*swarm.drone(i).start[:2], 1.0) for i in swarm.followers}
    start = Mission(BEGAN + 1, "world", "start", BEGAN, number=1)
    said, leader, now = {}, (0.0, 0.0, 1.0), BEGAN
    for tick in range(1, round(seconds * 100) + 1):
        now = BEGAN + tick * SECOND // 100
        leader = (0.001 * tick, 0.001 * tick, 1.0)
        heard, said = said, {}
        for i, agent in agents.items():
            agent.receive(MISSION, start, now)
            agent.receive(Key("telemetry", uav(i)), Telemetry(now, "world", FlightState.FLYING, 1.0, 1.0, 0.0), now)
            agent.receive(Key("nearby", uav(i)), Nearby(now, "world", ()), now)
            for j in swarm.topology.neighbours(i):
                if j == 0:
                    agent.receive(Key("pose", "uav0"), Pose(now, "world", leader), now)
                elif j in heard:
                    agent.receive(Key("estimate", uav(j)), heard[j], now)
            agent.receive(Key("pose", uav(i)), Pose(now, "world", places[i]), now)
            for key, message in agent.step(now):
                if isinstance(message, Estimate):
                    said[i] = message
                elif key.kind == "command":
                    places[i] = add(places[i], scale(message.velocity, 0.01))
    return places, leader, {i: agent.report(now) for i, agent in agents.items()}, said


@pytest.mark.parametrize("law", [{}, {"observer.step": "explicit"}])
def test_the_formation_converges(make_swarm, law):
    swarm = make_swarm(law)
    places, leader, reports, said = fly(swarm, 12.0)
    tolerance = 0.12 if law else 0.03  # the explicit observer chatters
    for i in swarm.followers:
        goal = add(leader, swarm.build_formation().offset(i - 1, 12.0))
        assert reports[i].phase is Phase.FORMATION
        assert dist(places[i], goal) < tolerance
        assert dist(said[i].motion.position, leader) < tolerance
        assert reports[i].formation_error < tolerance


def test_the_velocity_estimate_is_the_leaders(make_swarm):
    *_, said = fly(make_swarm(), 12.0)
    for estimate in said.values():
        assert estimate.motion.velocity == pytest.approx((0.1, 0.1, 0.0), abs=1e-3)

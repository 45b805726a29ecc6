"""The baseline laws of bench/ behave as their sources say."""

from math import cos, hypot, pi, sin

import pytest
from flockwire_core.control.observer import ObserverParameters
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.time import SECOND
from flockwire_core.law import Heard, Observation, Place
from flockwire_core.loading import parse_swarm
from flockwire_core.parameters import law_settings
from law_orca import HORIZON, Orca, half_plane
from law_sliding_mode import SlidingMode, sliding_step

STEP = 0.01  # s
PLACES = ((1.0, 0.0, 1.0), (0.0, 1.0, 1.0), (-1.0, 0.0, 1.0), (0.0, -1.0, 1.0))


class Still:
    """Places that do not move."""

    def __init__(self, places):
        self._places = places

    def offset(self, index, t):
        return self._places[index]

    def offset_rate(self, index, t):
        return (0.0, 0.0, 0.0)


def motion_of(position, velocity=(0.0, 0.0, 0.0)):
    return Motion(position, velocity, position)


def observed(now, motion, estimates, bodies=(), reference=None):
    return Observation(now / SECOND, STEP, now, bodies=bodies, heard=estimates, place=reference, now=now, motion=motion)


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_the_sliding_mode_observer_reaches_the_leader_in_finite_time_and_stays(speed):
    beta, first = 2.0, 3.0
    eta, reached = (first, 0.0, 0.0), None
    for k in range(400):
        leader = -speed * k * STEP  # it flees
        eta = sliding_step(eta, [(0.7, (leader, 0.0, 0.0))], ObserverParameters(beta, 1.5), STEP)
        if abs(eta[0] - leader) < 1e-9:
            reached = k * STEP if reached is None else reached
        else:
            assert reached is None  # it never leaves again, and does not chatter
    assert reached == pytest.approx(first / (beta - speed), abs=2 * STEP)


def test_the_observer_is_all_that_differs_from_the_papers_law(make_swarm):
    law = SlidingMode(law_settings(make_swarm({"control.law": "paper"}), 1))
    heard = [Heard(0, 1.0, True, 0, 1, LeaderMotion((1.0, 0.0, 0.0)))]
    decision = law.step(observed(0, motion_of((0.0, 0.0, 0.0)), heard))
    assert decision.message.position == pytest.approx((STEP * 3.0, 0.0, 0.0))


def swap(count, radius=1.5):
    """Let `count` drones on a circle change to the opposite places; returns the smallest distance, and who arrived."""
    table = {
        "name": "swap", "control": {"law": "law_orca:Orca"},
        "formation": {"kind": "circle", "radius": 1.0}, "leader": {"kind": "virtual"},
        "graph": {"edges": [[0, i] for i in range(1, count + 1)]},
        "drones": [{"id": i, "start": [3.0 * i, 0.0, 0.0]} for i in range(1, count + 1)],
        "limits": {"speed": 1.0, "fence": {"min": [-50, -50, -1], "max": [50, 50, 3]}},
    }  # fmt: skip
    swarm = parse_swarm(table, "test")
    laws = [Orca(law_settings(swarm, i + 1)) for i in range(count)]
    angles = [2.0 * pi * i / count for i in range(count)]
    places = [(-radius * cos(a), -radius * sin(a), 0.0) for a in angles]
    state = [((radius * cos(a), radius * sin(a), 0.0), (0.0, 0.0, 0.0)) for a in angles]
    nearest, leader = 9.0, LeaderMotion((0.0, 0.0, 0.0))
    for k in range(3000):
        now, after = round(k * STEP * SECOND), []
        for i, law in enumerate(laws):
            x, v = state[i]
            others = [
                Body(BodyKind.DRONE, tuple(p - q for p, q in zip(y, x, strict=True)), 0.0, w)
                for j, (y, w) in enumerate(state)
                if j != i
            ]
            heard, reference = [Heard(0, 1.0, True, now, 1, leader)], Place(Still(places), i, 0)
            u = law.step(observed(now, motion_of(x, v), heard, others, reference)).command
            after.append((tuple(p + STEP * q for p, q in zip(x, u, strict=True)), u))
        state = after
        pairs = [hypot(*(p - q for p, q in zip(a[0], b[0], strict=True))) for a in state for b in state if a is not b]
        nearest = min([nearest, *pairs])
    off = max(hypot(*(p - q for p, q in zip(x, y, strict=True))) for (x, _), y in zip(state, places, strict=True))
    return nearest, off, swarm.avoidance.drone_safety_distance


@pytest.mark.sources
def test_reciprocal_drones_change_places_without_coming_too_near():
    nearest, off, kept = swap(2)
    assert nearest > kept
    assert off < 0.02


def test_a_velocity_that_leads_into_a_body_within_the_horizon_is_outside_its_half_plane():
    body = Body(BodyKind.OBSTACLE, (2.0, 0.3, 0.0), 0.2, (0.0, 0.0, 0.0))
    towards, away = (1.5, 0.0, 0.0), (-0.5, 0.0, 0.0)
    nx, ny, _, bound = half_plane(towards, body, (2.0, 0.3), 0.6, 1.0)
    assert nx * towards[0] + ny * towards[1] < bound
    new = (towards[0] + (bound - nx * towards[0]) * nx, (bound - nx * towards[0]) * ny)  # on the plane: it just passes
    passes = min(hypot(2.0 - t / 100 * new[0], 0.3 - t / 100 * new[1]) for t in range(round(100 * HORIZON) + 1))
    assert passes == pytest.approx(0.6, abs=0.02)
    nx, ny, _, bound = half_plane(away, body, (2.0, 0.3), 0.6, 1.0)
    assert nx * away[0] + ny * away[1] >= bound

"""The safety filter against enumeration: every subset of planes that could be the active one is tried."""

from __future__ import annotations

from itertools import combinations
from random import Random

import numpy as np
import pytest
from flockwire_core.control.safety_filter import HalfSpace, nearest_velocity
from hypothesis import given
from hypothesis import strategies as st

AXES = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]


def problem(seed: int, hardest: float) -> tuple[tuple[float, ...], list[HalfSpace], float, tuple[float, ...]]:
    """Return wanted, half-spaces, radius and centre; the half-spaces ask for up to `hardest` of the radius."""
    draw = Random(seed)
    radius = draw.uniform(0.1, 3.0)
    centre = (0.0, 0.0, 0.0) if draw.random() < 0.5 else tuple(draw.uniform(-1.0, 1.0) for _ in range(3))
    spaces = []
    for _ in range(draw.randint(0, 8)):
        normal = np.array(draw.choice(AXES) if draw.random() < 0.2 else [draw.gauss(0, 1) for _ in range(3)])
        if draw.random() < 0.3:
            normal[2] = 0.0
            normal = normal if np.linalg.norm(normal) > 0.1 else np.array([1.0, 0.0, 0.0])
        normal = normal / np.linalg.norm(normal)
        b = draw.uniform(-1.0, hardest) * radius + normal @ np.array(centre)
        spaces.append((*map(float, normal), float(b)))
    wanted = tuple(draw.uniform(-2.0, 2.0) * radius for _ in range(3))
    return wanted, spaces, radius, centre


def flat(planes: list[tuple[np.ndarray, float]]) -> tuple[np.ndarray, np.ndarray] | None:
    """Return a point of the planes' common flat and a basis of its directions, None when there is none."""
    if not planes:
        return np.zeros(3), np.eye(3)
    a, b = np.array([n for n, _ in planes]), np.array([c for _, c in planes])
    point, *_ = np.linalg.lstsq(a, b, rcond=None)
    if np.abs(a @ point - b).max() > 1e-9:
        return None
    _, s, vt = np.linalg.svd(a)
    return point, vt[int((s > 1e-8).sum()) :]


def candidates(
    planes: list[tuple[np.ndarray, float]], radius: float, goal: np.ndarray, ahead: bool
) -> list[np.ndarray]:
    """Return the points of flat and ball nearest to `goal` (or farthest along it)."""
    found = flat(planes)
    if found is None or np.linalg.norm(found[0]) > radius:
        return []
    point, basis = found
    inner = np.sqrt(max(radius**2 - point @ point, 0.0))
    move = basis.T @ (basis @ (goal - (0 if ahead else point)))
    length = np.linalg.norm(move)
    if (ahead or length > inner) and length > 1e-12:
        move = move * inner / length
    return [point + move]


def enumerated(wanted, spaces, radius, centre) -> tuple[float, float]:
    """Return the least violation and, when that is 0, the distance of the nearest velocity."""
    c, goal = np.array(centre), np.array(wanted) - np.array(centre)
    planes = [(np.array(s[:3]), s[3] - np.array(s[:3]) @ c) for s in spaces]

    def violation(v: np.ndarray) -> float:
        return max((b - n @ v for n, b in planes), default=-1.0)

    points = [
        v for k in range(4) for some in combinations(planes, k) for v in candidates(list(some), radius, goal, False)
    ]
    feasible = [v for v in points if violation(v) <= 1e-9]
    if feasible:
        return 0.0, min(float(np.linalg.norm(v - goal)) for v in feasible)
    worst = []
    for k in range(1, 5):
        for some in combinations(planes, k):
            (n, b), *others = some
            bisectors = [((m - n) / np.linalg.norm(m - n), (d - b) / np.linalg.norm(m - n)) for m, d in others
                         if np.linalg.norm(m - n) > 1e-9]  # fmt: skip
            worst += [violation(v) for v in candidates(bisectors, radius, n, True)]
    return min(worst), 0.0


def lack(v, spaces) -> float:
    """Return the largest violation of half-spaces by v."""
    return max((b - x * v[0] - y * v[1] - z * v[2] for x, y, z, b in spaces), default=0.0)


@given(st.integers(0, 10**9), st.sampled_from([0.2, 0.6, 1.0, 2.0]))
def test_it_is_as_good_as_enumeration(seed: int, hardest: float) -> None:
    wanted, spaces, radius, centre = problem(seed, hardest)
    v, claimed = nearest_velocity(wanted, spaces, radius, centre)
    violation, distance = enumerated(wanted, spaces, radius, centre)
    met = lack(v, spaces)
    assert np.linalg.norm(np.array(v) - centre) <= radius + 1e-9
    assert met <= violation + 1e-9
    assert claimed == pytest.approx(max(violation, 0.0), abs=1e-9)
    if violation == 0.0:
        assert np.linalg.norm(np.array(v) - wanted) == pytest.approx(distance, abs=1e-9)


@given(st.integers(0, 10**9), st.sampled_from([0.6, 1.0, 2.0]), st.lists(st.integers(0, 2), min_size=8, max_size=8))
def test_no_rank_is_violated_for_a_higher_one(seed: int, hardest: float, ranks: list[int]) -> None:
    """Each rank's violation is the least that those before it leave, and the rest is as wanted."""
    wanted, spaces, radius, centre = problem(seed, hardest)
    v, violation = nearest_velocity(wanted, spaces, radius, centre, ranks[: len(spaces)])
    kept: list[HalfSpace] = []
    for rank in range(3):
        own = [space for space, its in zip(spaces, ranks, strict=False) if its == rank]
        least = max(lack(v, own), 0.0)
        if least > 1e-3:
            less = [(x, y, z, b - least + 1e-3) for x, y, z, b in own]
            assert nearest_velocity(wanted, [*kept, *less], radius, centre)[1] > 0.0
        kept += [(x, y, z, b - least - 1e-9) for x, y, z, b in own]
    assert violation == pytest.approx(max(lack(v, spaces), 0.0), abs=1e-6)
    nearest, left = nearest_velocity(wanted, kept, radius, centre)
    assert left == 0.0
    assert np.linalg.norm(np.subtract(v, wanted)) == pytest.approx(
        np.linalg.norm(np.subtract(nearest, wanted)), abs=1e-3
    )


def test_a_velocity_that_satisfies_all_is_left_alone() -> None:
    assert nearest_velocity((0.3, -0.2, 0.1), [(1.0, 0.0, 0.0, -1.0)], 1.0) == ((0.3, -0.2, 0.1), 0.0)


def test_without_half_spaces_it_is_cut_to_the_ball() -> None:
    v, violation = nearest_velocity((0.0, 4.0, 3.0), [], 1.0)
    assert v == pytest.approx((0.0, 0.8, 0.6))
    assert violation == 0.0


def test_between_two_bodies_too_close_it_shares_the_violation() -> None:
    """Neither zero nor what the last constraint left: the middle of what both ask for, the rest as wanted."""
    v, violation = nearest_velocity((0.0, 0.5, 0.0), [(1.0, 0.0, 0.0, 0.4), (-1.0, 0.0, 0.0, 0.2)], 1.0)
    assert v == pytest.approx((0.1, 0.5, 0.0), abs=1e-9)
    assert violation == pytest.approx(0.3)


def test_what_the_last_rank_cannot_get_relaxes_no_other() -> None:
    spaces = [(1.0, 0.0, 0.0, 0.4), (-1.0, 0.0, 0.0, 0.2), (0.0, 1.0, 0.0, 0.3)]
    v, violation = nearest_velocity((0.0, 0.5, 0.0), spaces, 1.0, ranks=(2, 1, 2))
    assert v == pytest.approx((-0.2, 0.5, 0.0), abs=1e-9)
    assert violation == pytest.approx(0.6)


def test_three_planes_meet_in_a_point() -> None:
    spaces = [(1.0, 0.0, 0.0, 0.1), (0.0, 1.0, 0.0, 0.2), (0.0, 0.0, 1.0, 0.3)]
    assert nearest_velocity((-1.0, -1.0, -1.0), spaces, 1.0)[0] == pytest.approx((0.1, 0.2, 0.3))


def test_a_half_space_beyond_the_ball_is_violated_least_at_its_edge() -> None:
    v, violation = nearest_velocity((0.0, 1.0, 0.0), [(1.0, 0.0, 0.0, 2.0)], 1.0)
    assert v == pytest.approx((1.0, 0.0, 0.0), abs=1e-5)
    assert violation == pytest.approx(1.0)

"""Poses that are not the drone's, and flights without any, drawn and flown (lab/bench/bodies.py)."""

from __future__ import annotations

import pytest
from bodies import KINDS, fly_honest, fly_lie


@pytest.mark.parametrize("kind", ["frozen", "swap"])
def test_whoever_gets_false_poses_lands_inside_the_fence_and_meets_nobody(kind: str) -> None:
    _, well = fly_lie(kind, 1)
    assert well


@pytest.mark.parametrize(
    "seed",
    [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 1063))],  # 1063: a wind too strong for its Tellos
)
def test_nobody_who_gets_its_own_poses_is_taken_for_another(seed: int) -> None:
    assert fly_honest(seed)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_of_each_kind_none_is_missed(kind: str) -> None:
    assert all(fly_lie(kind, seed)[1] for seed in range(1, 5))

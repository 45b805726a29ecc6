"""Wilson's interval of a share."""

from __future__ import annotations

from random import Random

import pytest
from flockwire_sim.study.confidence import wilson


def test_wilsons_interval_has_the_textbooks_values() -> None:
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert wilson(1000, 1000) == pytest.approx((0.99617, 1.0), abs=1e-5)
    with pytest.raises(ValueError, match="3 of 2"):
        wilson(3, 2)


def test_the_true_rate_lies_in_the_interval_as_often_as_promised() -> None:
    chance, held = Random(1), 0
    for _ in range(2000):
        low, high = wilson(sum(chance.random() < 0.9 for _ in range(100)), 100)
        held += low <= 0.9 <= high
    assert 0.93 < held / 2000 < 0.975

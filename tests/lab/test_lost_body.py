"""The flights of lab/bench/lost_body.py: a drone that the tracker loses is not struck, in flight or by who lands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from lost_body import Result, fly


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(4, id="one below it, which it lands through"),
        pytest.param(36, id="one above it, unseen for 1.5 s"),
        pytest.param(54, id="one above it that lands beside it"),
        pytest.param(50, id="others on a circle across its place"),
        pytest.param(56, id="others on a circle across its place, closer"),
    ],
)
def test_the_others_keep_clear_of_it_and_land_beside_it(seed: int) -> None:
    result = fly(seed)
    assert (result.nearest >= result.safe, result.others >= result.safe, result.high) == (True, True, ())


@pytest.mark.parametrize("bad", [{"nearest": 0.39}, {"others": 0.39}, {"high": ("uav3 at 0.41 m",)}])
def test_one_that_strikes_or_stays_up_would_be_seen(bad: dict[str, Any]) -> None:
    well = Result(0, "above", 2, 1.0, 1.5, nearest=0.5, others=0.5)
    assert well.well
    assert not replace(well, **bad).well

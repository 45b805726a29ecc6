from __future__ import annotations

import pytest
from flockwire_core.domain.motion import LeaderMotion
from hypothesis import given
from hypothesis import strategies as st


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_bringing_forward_twice_is_bringing_forward_once(first: float, second: float) -> None:
    motion = LeaderMotion((1.0, 2.0, 3.0), (0.1, -0.2, 0.3), (0.5, 0.4, -0.3))
    twice, once = motion.after(first).after(second), motion.after(first + second)
    for a, b in zip(twice.fields(), once.fields(), strict=True):
        assert a == pytest.approx(b, abs=1e-9)

from __future__ import annotations

from math import exp

import pytest
from flockwire_core.control.airframe.first_order_lag import lead
from flockwire_core.control.airframe.state import AirframeState
from hypothesis import given
from hypothesis import strategies as st


def fly(lag: float, dead_time: float, commands: list[float], rest: int) -> tuple[float, float, AirframeState]:
    """Fly one axis exactly; return where it is, where it rests, and the state that watched."""
    dt, delay = 0.01, round(dead_time / 0.01)
    state, x, v = AirframeState(lag, dead_time), 0.0, 0.0
    inputs = [0.0] * delay + commands + [0.0] * (rest + delay)
    at_end = (0.0, 0.0)
    for k, u in enumerate(inputs):
        state_now = k * dt
        if k <= len(commands):
            motion = state.measure((x, 0.0, 0.0), state_now, state_now)
            if k == len(commands):
                at_end = (x, motion.stopping[0])
            else:
                state.command((commands[k], 0.0, 0.0), state_now)
        decay = exp(-dt / lag) if lag else 0.0
        x += dt * u + lag * (1.0 - decay) * (v - u)
        v = u + decay * (v - u)
    return x, at_end[1], state


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=80), st.sampled_from([0.0, 0.1, 0.25]))
def test_the_stopping_point_is_where_it_comes_to_rest(commands: list[float], lag: float) -> None:
    rests, predicted, _ = fly(lag, 0.1, commands, 600)
    assert predicted == pytest.approx(rests, abs=1e-6)


def test_the_feed_forward_follows_a_ramp_and_its_stopping_point() -> None:
    """r = t^2/2 behind a lag of 0.2 s: u = t + D + 0.2."""
    assert lead((1.3, 0.0, 0.0), (1.0, 0.0, 0.0), 0.2) == pytest.approx((1.5, 0.0, 0.0))
    assert lead((2.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.2) == pytest.approx((2.2, 0.0, 1.0))


def test_commands_are_forgotten_without_poses_too() -> None:
    state = AirframeState(0.2, 0.1)
    for k in range(10_000):
        state.command((0.0, 0.0, 1.0), 0.01 * k)
    assert len(state._commands) < 1000
    assert state.measure((0.0, 0.0, 1.0), 99.9, 99.99).stopping[2] == pytest.approx(1.0 + 0.19, abs=0.02)

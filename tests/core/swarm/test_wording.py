"""A value beside the limit that it breaks is never shown as the limit."""

from flockwire_core.swarm.wording import beside
from hypothesis import given
from hypothesis import strategies as st


@given(st.floats(0.01, 100.0), st.integers(-14, -1))
def test_it_is_told_from_its_limit(limit: float, exponent: int) -> None:
    value = limit - 10.0**exponent
    if value != limit:
        assert float(beside(value, limit)) != limit
    assert beside(1.0, 0.4) == "1.00"
    assert [beside(value, 0.4 + 0.03) for value in (0.429, 0.42999)] == ["0.429", "0.42999"]  # no 0.43 to the bit
    assert (beside(0.3999, 0.4), beside(0.4 - 1e-17, 0.5)) == ("0.3999", "0.40")

from itertools import permutations

import pytest
from flockwire_core.control.assignment import assignment, least_cost
from hypothesis import given
from hypothesis import strategies as st

tables = st.tuples(st.integers(1, 5), st.integers(0, 1)).flatmap(
    lambda size: st.lists(
        st.lists(st.integers(0, 4) | st.floats(0.0, 9.0), min_size=sum(size), max_size=sum(size)),
        min_size=size[0],
        max_size=size[0],
    )
)


@given(tables)
def test_no_other_choice_costs_less(costs):
    found = least_cost(costs)
    assert len(set(found)) == len(costs)
    everyone = range(len(costs))
    best = min(sum(costs[i][j] for i, j in enumerate(some)) for some in permutations(range(len(costs[0])), len(costs)))
    assert sum(costs[i][found[i]] for i in everyone) <= best + 1e-9


def test_it_does_not_matter_from_where_places_are_counted():
    now, then = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 3.0, 1.0)], [(0.1, 2.0, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, 0.0)]
    assert assignment(now, then) == assignment(now, [(x + 7.0, y - 5.0, z) for x, y, z in then]) == (1, 2, 0)


def test_there_must_be_a_place_for_each():
    assert least_cost([]) == ()
    with pytest.raises(ValueError, match="2 rows have 1 columns"):
        least_cost([[1.0], [2.0]])

from math import inf

import numpy as np
import pytest
from flockwire_core.control.convergence import convergence, laplacian
from flockwire_core.control.graph import Graph
from hypothesis import given
from hypothesis import strategies as st

CHAIN = ((0, 1, 1.0), (1, 2, 1.0), (2, 3, 1.0), (3, 4, 1.0))
TREE = ((0, 1, 1.0), (1, 2, 1.0), (1, 3, 1.0), (2, 4, 1.0))
LOOP = (*CHAIN, (4, 1, 1.0))


@pytest.mark.parametrize(
    ("edges", "lambda_min", "margin", "bound"),
    [(CHAIN, 0.24288, 0.26432, 64.9), (TREE, 0.39003, 0.48505, 35.4), (LOOP, 0.05369, 0.05553, 87.7)],
    ids=["chain", "tree", "chain and 4 -> 1"],
)
def test_reference_values_of_lemma_3(edges, lambda_min, margin, bound):
    result = convergence(Graph((1, 2, 3, 4), edges), observer_gain=3.0, observer_exponent=1.5, leader_input_bound=0.1)
    assert result.lambda_min == pytest.approx(lambda_min, abs=5e-6)
    assert result.margin == pytest.approx(margin, abs=5e-6)
    assert result.settling_time_bound == pytest.approx(bound, abs=0.05)


def test_gamma_of_the_chain_is_one_over_the_depth():
    assert convergence(Graph((1, 2, 3, 4), CHAIN), 3.0, 1.5, 0.1).gamma == pytest.approx((1, 1 / 2, 1 / 3, 1 / 4))


def test_laplacian_orders_the_leader_first_and_then_the_followers_as_listed():
    graph = Graph((7, 3), ((0, 7, 2.0), (7, 3, 0.5), (0, 3, 1.0)))
    assert laplacian(graph).tolist() == [[0.0, 0.0, 0.0], [-2.0, 2.0, 0.0], [-1.0, -0.5, 1.5]]


@st.composite
def spanned_graphs(draw):
    """Return a random graph with a spanning tree: a parent for each follower, then any further edges."""
    count = draw(st.integers(1, 8))
    weights = st.floats(0.1, 10.0)
    edges = {(draw(st.integers(0, i - 1)), i): draw(weights) for i in range(1, count + 1)}
    for j, i in draw(st.lists(st.tuples(st.integers(0, count), st.integers(1, count)), max_size=2 * count)):
        if i != j:
            edges[j, i] = draw(weights)
    return Graph(tuple(range(1, count + 1)), tuple((j, i, w) for (j, i), w in edges.items()))


@given(spanned_graphs())
def test_gamma_is_positive_on_every_graph_with_a_spanning_tree(graph):
    assert min(convergence(graph, 3.0, 1.5, 0.1).gamma) > 0
    assert np.allclose(laplacian(graph).sum(axis=1), 0.0)


@given(spanned_graphs(), st.floats(0.01, 2.0))
def test_the_margin_changes_its_sign_at_the_smallest_gain(graph, leader_input_bound):
    smallest = convergence(graph, 3.0, 1.5, leader_input_bound).smallest_gain
    if smallest == inf:
        result = convergence(graph, 1e6, 1.5, leader_input_bound)
        assert result.margin <= 0
        assert result.settling_time_bound == inf
    else:
        assert convergence(graph, 1.01 * smallest, 1.5, leader_input_bound).margin > 0
        below = convergence(graph, 0.99 * smallest, 1.5, leader_input_bound)
        assert below.margin < 0
        assert below.settling_time_bound == inf


def test_the_leader_gain_is_the_norm_of_all_who_receive_from_the_leader():
    star = convergence(Graph((1, 2), ((0, 1, 1.0), (0, 2, 1.0))), 3.0, 1.5, 0.1)
    assert star.margin == pytest.approx(3.0 - 0.1 * 2**0.5)


def test_lemma_3_proves_nothing_where_one_follower_has_nine_receivers():
    hub = Graph(tuple(range(1, 11)), ((0, 1, 1.0), *((1, i, 1.0) for i in range(2, 11))))
    assert convergence(hub, 3.0, 1.5, 0.1).lambda_min < 0
    assert convergence(hub, 3.0, 1.5, 0.1).smallest_gain == inf


def test_a_graph_without_a_spanning_tree_is_refused():
    with pytest.raises(ValueError, match=r"followers \(2,\) have no path from the leader"):
        convergence(Graph((1, 2), ((0, 1, 1.0),)), 3.0, 1.5, 0.1)
    with pytest.raises(ValueError, match="at least one follower"):
        convergence(Graph((), ()), 3.0, 1.5, 0.1)

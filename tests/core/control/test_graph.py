import subprocess
import sys
from itertools import product

import pytest
from flockwire_core.control.graph import Graph
from hypothesis import given
from hypothesis import strategies as st

TREE = Graph((1, 2, 3, 4), ((0, 1, 1.0), (1, 2, 1.0), (1, 3, 0.5), (2, 4, 1.0), (3, 4, 2.0)))


def test_neighbours_are_the_sources_of_edges():
    assert TREE.neighbours(1) == {0: 1.0}
    assert TREE.neighbours(4) == {2: 1.0, 3: 2.0}


def test_listeners_are_those_who_receive():
    assert TREE.out_neighbours(1) == (2, 3)
    assert TREE.out_neighbours(4) == ()


def test_depths_count_the_fewest_hops():
    assert TREE.depths() == {0: 0, 1: 1, 2: 2, 3: 2, 4: 3}
    shortcut = Graph((1, 2, 3), ((0, 1, 1.0), (1, 2, 1.0), (2, 3, 1.0), (0, 3, 1.0), (3, 1, 1.0)))
    assert shortcut.depths() == {0: 0, 1: 1, 3: 1, 2: 2}


def test_followers_without_a_path_from_the_leader_are_named():
    assert TREE.unreachable() == ()
    assert Graph((1, 2, 3), ((0, 1, 1.0), (2, 3, 1.0), (3, 2, 1.0))).unreachable() == (2, 3)


@given(st.integers(1, 5), st.randoms(use_true_random=False))
def test_followers_are_parted_iff_one_cannot_reach_another(count, chance):
    followers = tuple(range(1, count + 1))
    links = [(i, j) for i in (0, *followers) for j in followers if i != j and chance.random() < 0.4]
    ends = Graph(followers, tuple((*link, 1.0) for link in links)).parted()
    reach = {(i, i) for i in followers} | {link for link in links if link[0] != 0}
    for k, i, j in product(followers, repeat=3):  # Warshall
        if (i, k) in reach and (k, j) in reach:
            reach.add((i, j))
    if ends is None:
        assert len(reach) == count * count
    else:
        assert ends not in reach


@pytest.mark.parametrize(
    ("followers", "edges", "rule"),
    [
        ((1, 1), (), "ids must differ"),
        ((0, 1), (), "ids must differ"),
        ((1,), ((0, 2, 1.0),), "edge 0 -> 2: there is no drone 2"),
        ((1,), ((1, 0, 1.0),), "edge 1 -> 0: a leader has no in-neighbours"),
        ((1,), ((1, 1, 1.0),), "edge 1 -> 1: a drone is not its own neighbour"),
        ((1,), ((0, 1, 1.0), (0, 1, 2.0)), "edge 0 -> 1: this edge appears twice"),
        ((1,), ((0, 1, 0.0),), r"edge 0 -> 1: weight = 0\.0 must be finite"),
        ((1,), ((0, 1, float("nan")),), "weight = nan must be finite"),
    ],
)
def test_a_wrong_graph_is_refused_by_name(followers, edges, rule):
    with pytest.raises(ValueError, match=rule):
        Graph(followers, edges)


def test_the_control_path_does_not_import_numpy():
    modules = ("graph", "observer", "formation", "key_frames", "potential", "protocol", "airframe.first_order_lag")
    imports = ", ".join(
        f"flockwire_core.{one}" for one in (*(f"control.{one}" for one in modules), "swarm.formation_rules")
    )
    code = f"import sys, {imports}; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

"""Cases of lab/bench/auction.py: each kind of formation, number of followers, links and loss once."""

from auction import run


def test_nobody_shares_a_place_and_the_cost_is_within_a_tenth_of_the_optimum():
    cases = [run(number, 1) for number in range(54)]
    assert not any(case.conflict for case in cases)
    assert all(case.cost <= 1.1 * case.optimum + 1e-9 for case in cases)
    assert any(case.cost > case.optimum + 1e-6 for case in cases)  # it is not the optimal algorithm
    assert max(case.rounds for case in cases) < 2000

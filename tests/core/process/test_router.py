"""The router's core: it keeps the process's rate and reports, and never stands between the others' messages."""

import pytest
from flockwire_core.domain.order import Stop
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Bystander, Start, make_core
from flockwire_core.wire.keys import STOP

NOW = 1_790_000_000 * SECOND


@pytest.fixture
def core(make_plan):
    """Return the core that the process table names for the router."""
    return make_core(Start(make_plan({"network.mode": "router"}), "router", NOW, chance=None))


def test_the_process_table_names_this_core(core):
    assert isinstance(core, Bystander)


def test_it_publishes_nothing_whatever_it_receives(core):
    for k in range(5):
        core.receive(STOP, Stop(NOW + k, "world", "test"), NOW + k)
        assert list(core.step(NOW + k)) == []


def test_it_steps_at_its_own_rate_alone(core):
    assert core.triggers == core.prompt == frozenset()
    assert core.period == 0.05


def test_it_reports_that_it_routes(core):
    assert (core.report(NOW).phase, core.report(NOW).detail) == ("routing", "")


def test_it_has_neither_keys_of_the_others_nor_anything_to_receive(make_plan):
    plan = make_plan({"network.mode": "router"})
    assert plan.subscribes["router"] == ()
    assert {key.kind for key in plan.publishes["router"]} == {"status"}

"""An order that reaches nobody names the cause."""

import asyncio

import pytest
from flockwire_core import clock
from flockwire_core.domain.order import Order
from flockwire_core.domain.time import SECOND
from flockwire_core.ground import delivery as core
from flockwire_core.runtime.session import Session
from flockwire_core.security.pki import make_keys
from flockwire_operator.station import giving
from flockwire_operator.station.giving import why_unlinked
from ports import free_ports


@pytest.fixture
def base():
    """Return a base port with free ports round it."""
    return free_ports()


@pytest.fixture
def keys(tmp_path):
    return tmp_path / "keys"


@pytest.fixture
def plan(make_plan, base, keys):
    found = make_plan({"network.base_port": base})
    make_keys(found, keys, clock.utc())
    return found


def why(plan, keys, *others):
    return asyncio.run(why_unlinked(plan, keys, others))


def test_no_process_listens(plan, keys, base):
    found = why(plan, keys, "gateway", "leader")
    assert found == (
        f"no process listens at the address of gateway, leader (127.0.0.1:{base - 1}, network.base_port = {base})"
    )


def test_a_process_with_other_keys_is_distinguished_from_a_slow_one(plan, keys, tmp_path, monkeypatch):
    monkeypatch.setattr(giving, "HANDSHAKE_TIME", 0.5)
    make_keys(plan, tmp_path / "other", clock.utc())
    with Session(plan, "gateway", keys):
        assert why(plan, tmp_path / "other", "gateway").startswith("gateway has a certificate of another authority")
        assert why(plan, keys, "gateway") == "gateway runs, but was not linked in time"


def test_a_process_that_refuses_our_keys_is_reported(plan, keys, tmp_path):
    make_keys(plan, tmp_path / "other", clock.utc())
    mixed = tmp_path / "other"
    (mixed / "ca.crt").write_bytes((keys / "ca.crt").read_bytes())
    with Session(plan, "gateway", keys):
        assert why(plan, mixed, "gateway") == f"gateway refuses the keys in {mixed}"


def test_a_host_that_does_not_answer(plan, keys, monkeypatch):
    async def never(*_, **__):
        await asyncio.Event().wait()

    monkeypatch.setattr(giving, "HANDSHAKE_TIME", 0.01)
    monkeypatch.setattr(asyncio, "open_connection", never)
    assert why(plan, keys, "uav1").startswith("no answer from the host of uav1 (127.0.0.1:")


def test_over_quic_an_unused_port_is_reported(make_plan, base, keys):
    plan = make_plan({"network.base_port": base, "network.link": "quic"})
    make_keys(plan, keys, clock.utc())
    assert why(plan, keys, "uav1").startswith("no process listens at the address of uav1")


@pytest.mark.parametrize("verb", ["hold", "land", "stop", "start"])
def test_an_order_without_receivers_was_not_sent_and_reports_why(plan, keys, monkeypatch, verb):
    for module, patience in (
        (core, "ANSWER_TIME"), (core, "LOOK_TIME"), (core, "READY_TIME"),
    ):  # fmt: skip
        monkeypatch.setattr(module, patience, SECOND // 10)
    answer = asyncio.run(giving.give(plan, keys, Order(verb)))
    assert answer.refusal.startswith(
        "nothing was sent: no process is linked: no process listens at the address of gateway, "
    )


def test_an_order_to_some_names_why_the_others_are_not_linked(plan, keys, monkeypatch):
    monkeypatch.setattr(core, "ANSWER_TIME", SECOND // 2)
    with Session(plan, "gateway", keys):
        answer = asyncio.run(giving.give(plan, keys, Order("stop")))
    assert answer.missing
    assert answer.refusal.startswith("sent, but not confirmed by uav0, ")
    assert "; no process listens at the address of " in answer.refusal
    assert "gateway" not in answer.refusal

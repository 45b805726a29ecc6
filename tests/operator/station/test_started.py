"""The processes that a station starts: their order, who is waited for, and a router that does not answer."""

import asyncio
import os
import signal
from contextlib import nullcontext
from pathlib import Path

import pytest
from flockwire_core.runtime import session as sessions
from flockwire_core.runtime.session import RouterAbsentError
from flockwire_operator.station import host as hosts
from flockwire_operator.station import operator, processes
from flockwire_operator.station.connecting import UNANSWERED
from flockwire_operator.station.host import Host
from flockwire_operator.station.processes import UnansweredError
from flockwire_operator.station.terminal.interrupts import Interrupts, interrupts
from ports import free_ports
from simulated_children import Processes
from simulated_pilots import SimulatedSwarm

TICK = 0.005  # s between two looks of these tests' stations


@pytest.fixture
def make_plan(make_plan):
    """Return the builder of a small swarm's plan at free ports."""
    base = free_ports()
    return lambda changes=None: make_plan({"network.base_port": base, **(changes or {})})


@pytest.fixture
def starting(make_plan, monkeypatch):
    """Return what starts a swarm's processes and returns them in their order; `lives`: who reports in the end."""

    def start(changes=None, lives=lambda _: True, interrupts=0):
        plan, children, interrupted = make_plan(changes), Processes(), Interrupts()
        interrupted.count = interrupts
        swarm = SimulatedSwarm(plan)
        message = swarm.message
        swarm.message = lambda key, now: (
            message(key, now) if key.kind != "status" or (key.owner in children.started and lives(key.owner)) else None
        )

        async def connected(*_, **__):
            return swarm

        async def run():
            async with processes.running(host, interrupted):
                pass

        monkeypatch.setattr(processes, "connected", connected)
        monkeypatch.setattr(processes, "Children", lambda *_: children)
        monkeypatch.setattr(hosts, "busy_endpoint", lambda *_: "")
        monkeypatch.setattr(processes, "flown_by", lambda *_: None)
        monkeypatch.setattr(processes, "flown", lambda *_: nullcontext())
        host = Host(plan, None, plan.hosts["recorder"], None, Path("none"))
        asyncio.run(run())
        return children.started

    monkeypatch.setattr(operator, "POLL_PERIOD", TICK)
    monkeypatch.setattr(processes, "START_TIME", 0.1)
    return start


def test_no_process_starts_before_those_that_it_waits_for_have_reported(starting):
    assert starting()[0] == "recorder"
    assert starting({"network.mode": "router"})[:2] == ["router", "recorder"]


def test_who_does_not_report_in_time_is_no_longer_waited_for(starting):
    assert sorted(starting(lives=lambda name: name != "recorder")) == sorted(starting())


def test_interrupted_it_starts_no_other_process(starting):
    assert starting(interrupts=1) == []


@pytest.fixture
def without_router(make_plan, monkeypatch):
    """Return what flies a swarm whose router never answers, and returns why that failed; `act` happens meanwhile."""

    def fly(act):
        plan, children, acts = make_plan({"network.mode": "router"}), Processes(), [act]

        def unanswered(*_):
            if acts:
                acts.pop()(children)
            raise RouterAbsentError

        async def run():
            host = Host(plan, None, plan.hosts["recorder"], None, Path("none"))
            with interrupts() as interrupted, pytest.raises(UnansweredError) as error:
                async with asyncio.timeout(10), processes.running(host, interrupted):
                    pass
            return str(error.value)

        monkeypatch.setattr(processes, "Children", lambda *_: children)
        monkeypatch.setattr(hosts, "busy_endpoint", lambda *_: "")
        monkeypatch.setattr(processes, "flown_by", lambda *_: None)
        monkeypatch.setattr(processes, "flown", lambda *_: nullcontext())
        monkeypatch.setattr(sessions, "Session", unanswered)
        return asyncio.run(run()), children.started

    return fly


def test_a_router_that_dies_before_it_answers_is_the_failure(without_router):
    dead = "router ended unexpectedly (signal SIGKILL)"
    assert without_router(lambda children: children.dead.append("router")) == (dead, ["router"])


def test_an_interrupt_ends_the_wait_for_the_router(without_router):
    assert without_router(lambda _: os.kill(os.getpid(), signal.SIGINT)) == (UNANSWERED, ["router"])

"""Places for operators at every process, which nobody else can use up, on real Zenoh."""

from __future__ import annotations

import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import zenoh
from flockwire_core import clock
from flockwire_core.domain.order import Stop
from flockwire_core.loading import load_swarm
from flockwire_core.runtime import configuration
from flockwire_core.runtime.samples import Buffered
from flockwire_core.runtime.session import STRANGERS, Session
from flockwire_core.security.files import files_of
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.keys import STOP
from flockwire_core.wire.plan import Plan
from flockwire_lab.probe.attackers import Attacker, attacker_configuration

DRIVER, OPERATOR = "kinematics", "operator"
FOREIGN = 12
STRANGER = "127.0.0.2"


@pytest.fixture
def plan(make_swarm: Callable[..., Path], tmp_path: Path) -> Plan:
    """Return the plan of the paper's swarm, whose keys are in `tmp_path`."""
    plan = Plan(load_swarm(make_swarm()))
    make_keys(plan, tmp_path, clock.utc())
    return plan


@pytest.fixture
def driver(plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    """Open a driver's session that has places for those that it is linked to, and no others."""
    monkeypatch.setattr(configuration, "SPARE_SESSIONS", 0)
    with Session(plan, DRIVER, tmp_path) as session:
        yield session


@pytest.fixture
def dial(plan: Plan, tmp_path: Path) -> Iterator[Callable[[str, str], zenoh.Session]]:
    """Return a function that opens a session with an identity's certificate to an endpoint, and keeps to no rule."""
    with ExitStack() as stack:

        def dialled(identity: str, endpoint: str) -> zenoh.Session:
            attacker = Attacker(identity, files_of(tmp_path, identity), "peer")
            config = attacker_configuration(attacker, [f"tls/{endpoint}"], str(tmp_path / "ca.crt"))
            return stack.enter_context(zenoh.open(config))

        yield dialled


def links(sessions: list[zenoh.Session], wanted: int, seconds: float = 3.0) -> int:
    """Wait until `wanted` of `sessions` are linked, or `seconds` are over; returns how many are."""
    deadline = time.monotonic() + seconds
    while (found := sum(bool(session.info.links()) for session in sessions)) < wanted and time.monotonic() < deadline:
        time.sleep(0.01)
    return found


def stopped(plan: Plan, keys: Path, inbox: Buffered) -> bool:
    """Order an emergency stop, as one command does; returns whether it arrived."""
    deadline = time.monotonic() + 3.0
    with Session(plan, OPERATOR, keys) as session:
        while time.monotonic() < deadline:
            session.publish([(STOP, Stop(clock.now(), plan.swarm.frame, "test"))])
            if inbox.message(clock.now()) is not None:
                return True
            time.sleep(0.01)
    return False


def test_a_stop_arrives_when_one_drone_holds_all_places(
    plan: Plan, driver: Session, dial: Callable[[str, str], zenoh.Session], tmp_path: Path
) -> None:
    inbox, places = driver.buffered(STOP), len(plan.links[DRIVER])
    foreign = [dial("uav2", plan.endpoints[DRIVER]) for _ in range(FOREIGN)]
    assert links(foreign, places) == places < FOREIGN
    assert stopped(plan, tmp_path, inbox)


def test_only_operators_get_reserved_places_and_need_no_others(
    plan: Plan, driver: Session, dial: Callable[[str, str], zenoh.Session]
) -> None:
    drone, operator = dial("uav2", plan.reserved[DRIVER]), dial(OPERATOR, plan.endpoints[DRIVER])
    welcome = [dial("uav2", plan.endpoints[DRIVER]), dial(OPERATOR, plan.reserved[DRIVER])]
    assert links(welcome, 2) == 2
    assert links([drone, operator], 1, seconds=0.5) == 0
    assert driver.linked() == (OPERATOR, "uav2")


@pytest.mark.skipif(sys.platform != "linux", reason="filters at sockets are Linux's")
@pytest.mark.parametrize("where", ["reserved", "endpoints"])
def test_an_address_with_many_silent_connections_is_shut_out_and_a_stop_arrives(
    plan: Plan, driver: Session, tmp_path: Path, where: str
) -> None:
    inbox, host_port = driver.buffered(STOP), getattr(plan, where)[DRIVER].rsplit(":", 1)
    place, many = (host_port[0], int(host_port[1])), STRANGERS + len(plan.links[DRIVER]) + 1
    with ExitStack() as stack:
        for _ in range(many):
            stack.enter_context(socket.create_connection(place, 1.0, (STRANGER, 0)))
        driver.guard()
        driver.guard()
        with pytest.raises(TimeoutError):
            socket.create_connection(place, 0.5, (STRANGER, 0))
        assert stopped(plan, tmp_path, inbox)

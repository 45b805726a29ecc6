"""Starts, commands and watches the real processes of a swarm."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
import zenoh
from flockwire_core import clock
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import load_swarm
from flockwire_core.pilot.orders import rank
from flockwire_core.runtime.session import RouterAbsentError, Session
from flockwire_core.security.files import Credentials
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.keys import MISSION, PROPOSAL
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR
from flockwire_core.wire.status import Status
from flockwire_lab.probe.attackers import Attacker, attacker_configuration, open_to
from flockwire_operator.station.host import Host
from ports import free_ports

SWARMS = Path(__file__).parents[2] / "examples"
CONTROL_RATE = 0.5  # share of the steps that a flight passes with on a busy machine
PATIENCE = 60.0  # s that a busy machine may take to do what a test waits for


def copy_swarm(folder: Path, source: str = "paper_simulation", **replaced: str) -> Path:
    """Copy a shipped swarm file into `folder`, to free ports; keywords replace lines `key = value`.

    Other tests run beside it: how many of its steps an agent makes then says nothing of the agent.
    """
    text = (SWARMS / f"{source}.toml").read_text()
    name = replaced.pop("name", tomllib.loads(text)["name"])
    lines = [f'name = "{name}"' if line.startswith("name = ") else line for line in text.splitlines()]
    for key, value in replaced.items():
        assert any(line.startswith(f"{key} = ") for line in lines), key
        lines = [f"{key} = {value}" if line.startswith(f"{key} = ") else line for line in lines]
    text = "\n".join(line for line in lines if not line.startswith(("[network]", "base_port")))
    path = folder / f"{name}.toml"
    path.write_text(f"{text}\n[network]\nbase_port = {free_ports()}\n[checks]\ncontrol_rate = {CONTROL_RATE}\n")
    return path


def keys_of(swarm_file: Path) -> Path:
    """Return where a test keeps the certificates of a swarm."""
    return swarm_file.with_name(f"keys-{swarm_file.stem}")


class Fleet:
    """The processes of one swarm, each started by hand."""

    def __init__(self, swarm_file: Path, out: Path) -> None:
        self.swarm_file, self.out = swarm_file, out
        self.keys = keys_of(swarm_file)
        self.plan = Plan(load_swarm(swarm_file))
        self.running: dict[str, subprocess.Popen[bytes]] = {}
        out.mkdir(exist_ok=True)
        make_keys(self.plan, self.keys, clock.utc())

    def start(self, *names: str, **options: object) -> None:
        """Start the named processes, all but the operator without names."""
        host = Host(self.plan, self.swarm_file, "localhost", self.out, self.keys)
        for name in names or self.plan.started:
            with (self.out / f"{name}.log").open("ab") as log:
                line = host.command_line(name)
                self.running[name] = subprocess.Popen(line, stderr=log, stdout=log, **options)

    @contextlib.contextmanager
    def insider(self, identity: str, mode: str = "peer") -> Iterator[zenoh.Session]:
        """Open a session with the certificate of `identity` that keeps to no rule and dials everybody."""
        credentials = Credentials(self.keys / "ca.crt", self.keys / f"{identity}.crt", self.keys / f"{identity}.key")
        targets = [self.plan.locator(endpoint) for endpoint in open_to(self.plan, identity).values()]
        attacker = Attacker(identity, credentials, mode)
        with zenoh.open(attacker_configuration(attacker, targets, str(self.keys / "ca.crt"))) as session:
            deadline = time.monotonic() + 3.0
            while len(session.info.links()) < len(targets) and time.monotonic() < deadline:
                time.sleep(0.02)
            time.sleep(0.3)  # until the others' subscriptions are known
            yield session

    def log(self, name: str) -> str:
        """Return what a process logged."""
        return (self.out / f"{name}.log").read_text()

    def end(self, name: str, number: int = signal.SIGTERM) -> float:
        """End a process; returns the seconds that it took."""
        process = self.running.pop(name)
        began = time.monotonic()
        process.send_signal(number)
        process.wait(10)
        return time.monotonic() - began

    def end_all(self) -> None:
        """End what still runs."""
        for process in self.running.values():
            process.kill()
        for process in self.running.values():
            process.wait()


def _opened(plan: Plan, keys: Path) -> Session:
    for _ in range(40):
        with contextlib.suppress(RouterAbsentError):
            return Session(plan, OPERATOR.kind, keys)
    raise AssertionError("the router does not answer")


def _has(seen: dict[str, Status], order: Mission) -> bool:
    """Return whether the gateway reports `order` as the last of its log."""
    last = seen["gateway"].report.mission if "gateway" in seen else None
    return last is not None and last.stamp == order.stamp


class Tower:
    """An operator that waits for what it wants to see."""

    def __init__(self, plan: Plan, keys: Path) -> None:
        self._swarm, self._session = plan.swarm, _opened(plan, keys)
        self._sources = [self._session.buffered(key) for key in plan.subscribes[OPERATOR.kind] if key.kind == "status"]
        self.statuses: dict[str, Status] = {}

    def close(self) -> None:
        """End the session."""
        self._session.close()

    def order(self, verb: str, delay: float = 0.5) -> None:
        """Give an order; one that takes up is repeated until the gateway that is heard has it in its log."""
        now = clock.now()
        log = self.statuses["gateway"].report.mission if "gateway" in self.statuses else None
        number = log.number if log is not None else 0
        start = now + round(delay * 1e9)
        order = Mission(now, self._swarm.frame, verb, start)
        key, order = (MISSION, order) if rank(order) else (PROPOSAL, order._replace(number=number))
        self._session.publish([(key, order)])
        while key == PROPOSAL and "gateway" in self.statuses and clock.now() - now < 3 * SECOND:
            with contextlib.suppress(AssertionError):
                self.wait(lambda seen: _has(seen, order), 0.3)
                return
            self._session.publish([(key, order)])

    def wait(self, met: Callable[[dict[str, Status]], bool], seconds: float = PATIENCE) -> dict[str, Status]:
        """Poll until the fresh statuses are as wanted."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            now = clock.now()
            for source in self._sources:
                status = source.message(now)
                if status is not None:
                    self.statuses[status.identity] = status
            fresh = {name: status for name, status in self.statuses.items() if now - status.stamp < 1_000_000_000}
            if met(fresh):
                return fresh
            time.sleep(0.02)
        states = {name: (status.report.phase, status.report.detail) for name, status in self.statuses.items()}
        raise AssertionError(f"not seen within {seconds} s; last: {states}")

    def all_in(self, phase: str, *names: str, seconds: float = PATIENCE) -> dict[str, Status]:
        """Wait until all pilots, or those named, are in a phase."""
        wanted = names or ("leader", *(f"uav{i}" for i in self._swarm.followers))
        return self.wait(lambda seen: all(n in seen and seen[n].report.phase == phase for n in wanted), seconds)

    def settled(self, error: float, seconds: float = PATIENCE) -> None:
        """Wait until every follower is within `error` m of its place."""
        followers = [f"uav{i}" for i in self._swarm.followers]
        self.wait(
            lambda seen: all(n in seen and 0 <= seen[n].report.formation_error < error for n in followers), seconds
        )

    def fly(self) -> None:
        """Take off and start the formation."""
        self.all_in("ready")
        self.wait(lambda seen: "gateway" in seen)  # a proposal is given once, and needs this link
        self.order("takeoff")
        self.all_in("hold")
        self.order("start")
        self.all_in("formation")


def flockwire(*arguments: str | Path, **options: object) -> subprocess.Popen[str]:
    """Start a `flockwire` command."""
    line = [sys.executable, "-m", "flockwire_operator", *(str(argument) for argument in arguments)]
    swarm_file = next((a for a in arguments if isinstance(a, Path) and a.suffix == ".toml"), None)
    if swarm_file is not None and arguments[0] != "sim" and "--keys" not in arguments:
        line += ["--out" if arguments[0] == "keys" else "--keys", str(keys_of(swarm_file))]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def processes_of(swarm_file: Path) -> list[psutil.Process]:
    """Return all living processes that run for a swarm file."""
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if str(swarm_file) in process.cmdline() and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
    return found


def agree(real: dict[str, Any], virtual: dict[str, Any]) -> None:
    """Assert that the summaries of a flight in both worlds tell the same."""
    for error in ("observation_error_m", "formation_error_m"):
        for figure in ("max_tail", "rms_tail"):
            wanted = virtual[error][figure]
            same = None if wanted is None else pytest.approx(wanted, rel=0.2, abs=0.005)  # a law may observe no leader
            assert real[error][figure] == same, (error, figure)
    assert real["formation_error_m"]["settled_s"] == pytest.approx(virtual["formation_error_m"]["settled_s"], abs=0.3)
    assert real["min_distance_uav_m"] == pytest.approx(virtual["min_distance_uav_m"], abs=0.05)

import asyncio
import json
import socket
import subprocess
import sys
from types import SimpleNamespace

import pytest
from flockwire_core import clock
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.runtime import reporting
from flockwire_core.runtime.reporting import Supervision, peak_memory
from flockwire_core.wire.status import Report
from flockwire_operator.cli import health

PEAK = "from flockwire_core.runtime.reporting import peak_memory; print(peak_memory())"


@pytest.fixture
def systemd(tmp_path):
    """Return a socket such as systemd has, and its address."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
        receiver.bind(str(tmp_path / "notify"))
        receiver.setblocking(False)
        yield receiver, str(tmp_path / "notify")


@pytest.fixture
def now(monkeypatch):
    """Return the list whose first item is the monotonic time, ns."""
    time = [100 * SECOND]
    monkeypatch.setattr(clock, "monotonic", lambda: time[0])
    return time


def received(receiver):
    messages = []
    while True:
        try:
            messages.append(receiver.recv(4096))
        except BlockingIOError:
            return messages


def test_systemd_is_notified_of_the_first_step_and_then_at_half_the_watchdogs_time(systemd, now):
    receiver, address = systemd
    told = Supervision("uav1", {reporting.NOTIFY: address, reporting.WATCHDOG: "2000000"})
    assert received(receiver) == []  # no step yet
    times = []
    for _ in range(50):
        told.completed(Report("hold"))
        times += [(now[0] - 100 * SECOND) / SECOND] * len(received(receiver))
        now[0] += SECOND // 10
    assert times == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_readiness_comes_first_and_without_steps_nothing_comes(systemd, now):
    receiver, address = systemd
    told = Supervision("uav1", {reporting.NOTIFY: address, reporting.WATCHDOG: "2000000"})
    told.completed(Report("hold"))
    now[0] += 100 * SECOND
    assert received(receiver) == [b"READY=1\nWATCHDOG=1"]
    told.completed(Report("hold"))
    assert received(receiver) == [b"WATCHDOG=1"]


def test_a_systemd_that_is_gone_ends_nothing(tmp_path, now):
    told = Supervision("uav1", {reporting.NOTIFY: str(tmp_path / "nobody")})
    told.completed(Report("hold"))
    assert json.loads(told.answer(now[0]))["phase"] == "hold"


def test_an_abstract_address_is_understood(now):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
        receiver.bind("\0flockwire-test-supervision")
        Supervision("uav1", {reporting.NOTIFY: "@flockwire-test-supervision"}).completed(Report("hold"))
        receiver.setblocking(False)
        assert received(receiver) == [b"READY=1\nWATCHDOG=1"]


def asked(monkeypatch, path, told, *reports, age=0.0):
    """Return how a process that has reported so, the last step `age` s ago, answers a health check."""
    answers = []

    async def process():
        supervised = Supervision("uav1", {reporting.HEALTH: path})
        for report in reports:
            supervised.completed(report)
        later = SimpleNamespace(monotonic=lambda: clock.monotonic() + nanoseconds(age))
        monkeypatch.setattr(reporting, "clock", later)
        answers.append(await asyncio.to_thread(told, path))

    asyncio.run(process())
    return answers[0]


def test_a_process_that_steps_is_healthy_and_reports_what_it_does(tmp_path, monkeypatch):
    path = str(tmp_path / "health")
    assert asked(monkeypatch, path, health.ask, Report("hold", "no fresh pose")) == (True, "uav1: hold no fresh pose")
    assert asked(monkeypatch, path, health.ask, Report("ready")) == (True, "uav1: ready")  # in place of the one before


def test_one_that_has_not_stepped_or_not_for_long_is_not(tmp_path, monkeypatch):
    path = str(tmp_path / "health")
    assert asked(monkeypatch, path, health.ask) == (False, "uav1: starting; no step yet")
    well, line = asked(monkeypatch, path, health.ask, Report("formation"), age=5.0)
    assert not well
    assert line.startswith("uav1: formation; last step 5.")


def test_a_frozen_or_missing_process_is_not_healthy(tmp_path, monkeypatch):
    monkeypatch.setattr(health, "PATIENCE", 0.05)
    path = str(tmp_path / "health")
    assert health.ask(path) == (False, f"{path}: no process answers: No such file or directory")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as frozen:
        frozen.bind(path)
        assert health.ask(path) == (False, "no answer within 0.05 s: its loop is frozen")


def test_the_answer_is_json(tmp_path):
    told = Supervision("uav1", {})
    told.completed(Report("hold"))
    answer = json.loads(told.answer(clock.monotonic() + SECOND))
    assert (answer["identity"], answer["phase"]) == ("uav1", "hold")
    assert answer["step_age_s"] == pytest.approx(1.0, abs=0.5)


def test_where_it_cannot_answer_it_runs_anyway(tmp_path, caplog):
    Supervision("uav1", {reporting.HEALTH: str(tmp_path / "no" / "folder")}).completed(Report("hold"))
    assert "cannot answer health checks there" in caplog.text


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone passes a parent's peak on")
def test_a_process_s_memory_is_not_that_of_who_started_it():
    held = bytearray(300 << 20)
    held[:: 1 << 12] = b"x" * (len(held) >> 12)  # resident, each page
    started = subprocess.run([sys.executable, "-c", PEAK], capture_output=True, text=True, check=True)
    assert peak_memory() >= len(held)
    assert 1 << 20 < int(started.stdout) < len(held)

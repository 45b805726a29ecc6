"""Keys in flight, and what the user or the system asks of `up`."""

import asyncio
import os
import signal
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_operator.station.terminal.interrupts import Interrupts, interrupts
from flockwire_operator.station.terminal.keyboard import TWICE, Keyboard, hint, keys_pressed
from waiting import until


@pytest.fixture
def orders():
    return []


@pytest.mark.parametrize(("key", "order"), [("h", "hold"), ("l", "land"), ("f", "resume")])
def test_a_key_is_an_order_at_once(orders, key, order):
    Keyboard(orders.append).press(key, SECOND)
    assert orders == [order]


@pytest.mark.parametrize("key", ["x", "H", "\x1b", "", "\ufffd"])
def test_any_other_key_is_none(orders, key):
    Keyboard(orders.append).press(key, SECOND)
    assert orders == []


@pytest.mark.parametrize(
    ("pressed", "stops"),
    [([0], 0), ([0, TWICE], 1), ([0, TWICE + 1], 0), ([0, TWICE + 1, TWICE + 2], 1), ([0, 1, 2], 2)],
)
def test_a_stop_takes_two_presses_within_a_second(orders, pressed, stops):
    keyboard = Keyboard(orders.append)
    for moment in pressed:
        keyboard.press("s", 10 * SECOND + moment)
    assert orders == ["stop"] * stops


def test_keys_come_from_the_terminal_and_it_is_left_as_it_was(orders, terminal):
    ours, theirs = terminal
    before = termios.tcgetattr(theirs)

    async def run():
        with keys_pressed(Keyboard(orders.append).press):
            os.write(ours, b"hl")
            await until(lambda: len(orders) == 2)

    asyncio.run(run())
    assert orders == ["hold", "land"]
    assert termios.tcgetattr(theirs) == before
    os.close(ours)


def test_a_terminal_that_goes_away_is_not_an_error(orders, terminal):
    async def run():
        with keys_pressed(Keyboard(orders.append).press):
            os.close(terminal[0])
            await asyncio.sleep(0.05)

    asyncio.run(run())
    assert orders == []


BEHIND = """
import asyncio, os, pty, sys
from flockwire_operator.station.terminal.keyboard import foreground, keys_pressed

async def fly():
    with keys_pressed(lambda key, now: None):
        await asyncio.sleep(0)

terminal, ours = pty.fork()
if terminal:  # whose child leads the terminal's session
    sys.exit(os.waitstatus_to_exitcode(os.waitpid(terminal, 0)[1]))
assert foreground(sys.stdin)
job = os.fork()
if job:
    _, how = os.waitpid(job, os.WUNTRACED)
    os._exit(9 if os.WIFSTOPPED(how) else os.waitstatus_to_exitcode(how))
{leaves}
asyncio.run(fly())
os._exit(int(foreground(sys.stdin)))
"""


@pytest.mark.parametrize("leaves", ["os.setpgid(0, 0)", "os.setsid()"], ids=["up &", "setsid up"])
def test_in_the_background_of_a_terminal_its_keys_are_not_read_and_its_modes_stay(leaves):
    done = subprocess.run([sys.executable, "-c", BEHIND.format(leaves=leaves)], timeout=60, check=False)
    assert done.returncode == 0


def test_control_z_is_a_key_while_a_swarm_flies(orders, terminal):
    async def run():
        with keys_pressed(lambda key, _: orders.append(key)):
            assert termios.tcgetattr(terminal[1])[3] & termios.ISIG
            os.write(terminal[0], b"\x1a")
            await until(lambda: orders)

    asyncio.run(run())
    assert orders == ["\x1a"]


def test_a_command_that_was_started_to_outlive_its_terminal_does():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does

    async def run():
        with interrupts() as taken:
            os.kill(os.getpid(), signal.SIGHUP)
            os.kill(os.getpid(), signal.SIGTERM)
            await until(lambda: taken.count)
            assert taken.count == 1

    asyncio.run(run())
    assert signal.signal(signal.SIGHUP, before) is signal.SIG_IGN


def test_without_a_terminal_nothing_is_read(orders, monkeypatch):
    with Path(os.devnull).open() as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        with keys_pressed(Keyboard(orders.append).press):
            pass
    assert orders == []


def test_keys_are_shown_only_where_there_is_a_terminal_to_press_them(terminal, monkeypatch):
    assert hint() == "h hold, f resume, l land, ss stop; Ctrl-C lands"
    with Path(os.devnull).open() as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        assert hint() == "Ctrl-C lands"
    monkeypatch.setattr("sys.stdin", None)  # which was closed before this process began
    assert hint() == "Ctrl-C lands"


def test_a_terminal_that_closes_counts_once_however_it_reports_it():
    taken = Interrupts()
    taken.take(signal.SIGHUP)
    taken.take(signal.SIGHUP)
    assert taken.count == 1
    taken.take(signal.SIGTERM)
    assert taken.count == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_every_interrupt_counts(number):
    async def run():
        with interrupts() as taken:
            for k in (1, 2):
                os.kill(os.getpid(), number)
                await until(lambda k=k: taken.count == k)
        assert taken.count == 2

    asyncio.run(run())

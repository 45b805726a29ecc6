"""When a process ends: signals, a parent that is gone, what flies, and whom it waits for."""

import asyncio
import contextlib
import os
import signal
import threading

import pytest
from flockwire_core.runtime import ending as module
from flockwire_core.runtime.ending import LIFELINE, UNDONE, Ending, last_resort, wait_for_end
from waiting import until

SOON = 5.0  # s in which what must happen has long happened


class Flyer:
    """A core that may end once it is `down`."""

    def __init__(self, down=False):
        self.down, self.retired = down, []

    def retire(self, now):
        self.retired.append(now)

    def may_end(self, now):
        return self.down


class Links:
    """A session by its links alone."""

    def __init__(self, *identities):
        self.identities = set(identities)

    def linked(self):
        return tuple(sorted(self.identities))


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(module, "POLL", 0.002)


@pytest.fixture
def lifeline(monkeypatch):
    """Return the end that a parent keeps; it is this process's lifeline."""
    read_end, write_end = os.pipe()
    monkeypatch.setenv(LIFELINE, str(read_end))
    yield write_end
    os.close(read_end)


def raised(number):
    os.kill(os.getpid(), number)


async def passes():
    """Let some polls pass."""
    await asyncio.sleep(0.05)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_any_of_three_signals_asks_it_to_end_and_the_second_insists(number):
    async def run():
        ending = Ending()
        raised(number)
        await until(ending.ended.is_set)
        assert (ending.insisted, ending.orphaned) == (False, False)
        raised(signal.SIGTERM)
        await until(lambda: ending.insisted)

    asyncio.run(run())


def test_a_parent_that_is_gone_asks_it_to_end(lifeline):
    async def run():
        ending = Ending()
        os.write(lifeline, b"x")
        await passes()
        assert not ending.ended.is_set()
        os.close(lifeline)
        await until(ending.ended.is_set)
        assert (ending.insisted, ending.orphaned) == (False, True)
        raised(signal.SIGTERM)
        await passes()
        assert not ending.insisted  # whoever closes the terminal as well does not let a drone fall

    asyncio.run(run())


def waiting(make_plan, identity, core, links, act):
    """Run `finished` beside `act`, which gets the ending and the task."""

    async def run():
        ending = Ending()
        links.plan, links.identity = make_plan(), identity
        task = asyncio.create_task(wait_for_end(core, links, ending))
        await passes()
        await act(ending, task)
        async with asyncio.timeout(SOON):
            await task

    asyncio.run(run())


def test_flying_drones_are_asked_to_land_once_and_end_when_down(make_plan):
    core = Flyer()

    async def act(_, task):
        assert core.retired == []
        raised(signal.SIGTERM)
        await until(lambda: core.retired)
        await passes()
        assert not task.done()
        core.down = True

    waiting(make_plan, "uav1", core, Links("gateway", "kinematics"), act)
    assert len(core.retired) == 1


def test_asked_twice_to_end_it_ends_in_the_air(make_plan):
    core = Flyer()

    async def act(_, task):
        raised(signal.SIGTERM)
        await passes()
        assert not task.done()
        raised(signal.SIGTERM)

    waiting(make_plan, "uav1", core, Links(), act)
    assert not core.down


def test_with_its_parent_it_waits_for_no_other_process(make_plan):
    async def act(*_):
        raised(signal.SIGTERM)

    waiting(make_plan, "recorder", Flyer(down=True), Links("uav1", "kinematics", "gateway"), act)


@pytest.mark.parametrize(
    ("identity", "ranks"),
    [
        ("recorder", [("uav1", "leader"), ("kinematics",), ("gateway",)]),
        ("gateway", [("uav1", "uav2"), ("kinematics",)]),
        ("kinematics", [("uav3",)]),
    ],
)
def test_without_its_parent_it_waits_for_all_that_end_before_it(make_plan, lifeline, identity, ranks):
    links = Links("a stranger", "unknown", *(name for rank in ranks for name in rank))

    async def act(_, task):
        os.close(lifeline)
        for rank in ranks:
            await passes()
            assert not task.done()
            links.identities.difference_update(rank)

    waiting(make_plan, identity, Flyer(down=True), links, act)


def test_without_its_parent_a_pilot_waits_for_its_own_drone_alone(make_plan, lifeline):
    core = Flyer()

    async def act(_, task):
        os.close(lifeline)
        await until(lambda: core.retired)
        await passes()
        assert not task.done()
        core.down = True

    waiting(make_plan, "uav1", core, Links("uav2", "kinematics", "gateway", "recorder"), act)


@pytest.mark.parametrize(
    ("done", "status", "told"), [(True, 0, "its work is done"), (False, UNDONE, "its work is not done")]
)
def test_a_session_that_does_not_close_ends_the_process_with_a_log_line_and_status_0_if_its_work_is_done(
    monkeypatch, caplog, done, status, told
):
    ended, statuses = threading.Event(), []

    def leave(number):
        statuses.append(number)
        ended.set()

    monkeypatch.setattr(module, "LAST_RESORT", 0.0)
    monkeypatch.setattr(module.os, "_exit", leave)
    with contextlib.suppress(OSError), last_resort("recorder", lambda: None):
        if not done:
            raise OSError
    assert ended.wait(SOON)
    assert statuses == [status]
    (line,) = caplog.messages
    assert line.startswith("the session did not close in ")
    assert line.endswith(told)

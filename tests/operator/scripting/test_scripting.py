"""Flights by script: the one of docs/scripting.md, in virtual time and for real, and what goes wrong in one."""

import asyncio
import runpy
import threading

import pytest
from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.ground import director
from flockwire_core.runtime.standard_streams import later
from flockwire_core.security.files import CredentialsError
from flockwire_operator.scripting import FlightError, open_swarm, real
from flockwire_operator.station import host as hosts
from flockwire_operator.station import operator, processes
from ports import free_ports
from simulated_children import Processes
from simulated_pilots import SimulatedSwarm


@pytest.fixture
def script(example, tmp_path, monkeypatch):
    """Return the page's coroutine, in a folder with the page's swarm file."""
    (tmp_path / "mine.toml").write_text(example("scripting", "toml"))
    (tmp_path / "show.py").write_text(example("scripting", "python"))
    monkeypatch.chdir(tmp_path)
    return runpy.run_path("show.py")["show"]


@pytest.fixture
def swarm_file(script, tmp_path):
    return tmp_path / "mine.toml"


def test_the_page_s_script_flies_in_virtual_time_as_a_flight_without_one(script):
    phases, summary = asyncio.run(script(virtual=True))
    assert phases == ["formation", "formation"]
    assert summary.ok, summary.failures()
    assert summary.formation_error_m.max_tail < 0.001
    assert len(summary.phases) == 2


@pytest.mark.parametrize("how", [{}, {"virtual": True, "out": "flown"}], ids=["real", "virtual"])
def test_without_the_package_of_its_report_nothing_flies(swarm_file, tmp_path, monkeypatch, how):
    async def fly():
        async with open_swarm(swarm_file, **how):
            pytest.fail("it has opened")

    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr("flockwire_core.extras.find_spec", lambda _: None)
    with pytest.raises(ModuleNotFoundError, match=r"^the report needs the package matplotlib: .* install ") as raised:
        asyncio.run(fly())
    assert raised.value.name == "matplotlib"
    assert sorted(tmp_path.iterdir()) == before


def test_every_order_returns_when_it_is_obeyed(swarm_file):
    async def fly():
        seen = []
        async with open_swarm(swarm_file, virtual=True) as flight:
            await flight.start()
            seen.append({drone.phase for drone in flight.drones.values()})
            assert flight.drones[0].formation_error is None  # the leader is in nobody's formation
            assert flight.drones[1].formation_error >= 0.0
            assert flight.drones[1].position[2] == pytest.approx(1.0, abs=0.1)
            await flight.hold()
            seen.append({drone.phase for drone in flight.drones.values()})
            await flight.start()
            seen.append({drone.phase for drone in flight.drones.values()})
        seen.append({drone.phase for drone in flight.drones.values()})  # what flew at the end has landed
        return seen

    *flown, last = asyncio.run(fly())
    assert flown == [{"formation"}, {"hold"}, {"formation"}]
    assert last <= {"grounded", "ready"}


def test_what_is_not_obeyed_is_an_error_that_reports_why(swarm_file):
    async def fly():
        async with open_swarm(swarm_file, virtual=True) as flight:
            with pytest.raises(FlightError, match="must be one of \\['wide'\\]"):
                await flight.start("narrow")
            with pytest.raises(FlightError, match="no drone flies a formation"):
                await flight.formation("wide")
            with pytest.raises(FlightError, match=r"not done after 1 s: .*leader"):
                await flight.wait_for("formation", patience=1.0)
            with pytest.raises(FlightError, match=r"^wait for 'formatoin': must be one of grounded, ready, take-off, "):
                await flight.wait_for("formatoin")
            await flight.start()
            await flight.stop("enough")
        return flight.summary

    assert any("enough" in sentence for sentence in asyncio.run(fly()).failures())


def opening(*arguments, **more):
    async def run():
        async with open_swarm(*arguments, **more):
            pass

    asyncio.run(run())


def test_keys_that_cannot_be_used_are_an_error_of_the_script(swarm_file, tmp_path):
    (tmp_path / ".flockwire").touch()
    with pytest.raises(CredentialsError, match="cannot write keys there"):
        opening(swarm_file)
    (tmp_path / ".flockwire").unlink()
    keys = tmp_path / ".flockwire" / "mine" / "keys"
    keys.mkdir(parents=True)
    (keys / "ca.crt").write_text("junk")
    with pytest.raises(CredentialsError, match=f"{keys}"):
        opening(swarm_file)


@pytest.mark.parametrize("virtual", [False, True])
def test_a_second_flight_into_one_folder_is_refused(swarm_file, tmp_path, virtual):
    (tmp_path / "trace.mcap").write_text("another flight's")
    with pytest.raises(FileExistsError, match="there is a trace of another flight; name a new folder"):
        opening(swarm_file, virtual=virtual, out=tmp_path)
    assert (tmp_path / "trace.mcap").read_text() == "another flight's"


@pytest.fixture
def children():
    return Processes()


@pytest.fixture
def opened_without_trace(make_plan, children, tmp_path, monkeypatch):
    """Return what opens a real flight of processes and pilots that are simulated, and that nobody records."""
    plan = make_plan({"network.security": "none"})

    async def connected(*_, **__):
        return SimulatedSwarm(plan)

    async def start_processes(*_):
        """All run."""

    monkeypatch.setattr(director, "LEAD_TIME", SECOND // 50)
    monkeypatch.setattr(processes, "Children", lambda *_: children)
    monkeypatch.setattr(hosts, "busy_endpoint", lambda *_: "")
    monkeypatch.setattr(processes, "connected", connected)
    monkeypatch.setattr(processes, "start_processes", start_processes)
    (tmp_path / "mine.toml").touch()
    return lambda: real.real_flight(plan, tmp_path / "mine.toml", tmp_path)


@pytest.fixture
def opened(opened_without_trace, monkeypatch):
    """Return what opens such a flight, with a report."""
    monkeypatch.setattr(real, "write_report", lambda *_: None)
    return opened_without_trace


def test_a_recorder_that_dies_is_restarted_in_a_real_flight(opened, children, capsys):
    async def fly():
        async with opened() as flight:
            await flight.start()
            children.dead.append("recorder")
            await flight.sleep(0.2)
            assert {drone.phase for drone in flight.drones.values()} == {"formation"}

    asyncio.run(fly())
    assert children.started == ["recorder"]
    assert "flockwire: recorder ended unexpectedly (signal SIGKILL); restarted\n" in capsys.readouterr().err


def test_another_process_that_dies_lands_a_real_flight_and_fails_its_order(opened, children):
    async def fly():
        async with opened() as flight:
            await flight.start()
            children.dead.append("uav2")
            with pytest.raises(FlightError, match=r"^wait for 'hold': uav2 ended unexpectedly \(signal SIGKILL\)"):
                await flight.wait_for("hold")
            await flight.wait_for("ready")

    asyncio.run(fly())


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_a_change_that_was_planned_before_another_order_is_not_flown(opened, verb, monkeypatch):
    async def fly():
        async with opened() as flight:
            await flight.start()

            async def order_meanwhile():
                getattr(flight._core.director, verb)(clock.now())
                await flight.sleep(0.3)

            def plan(_, made):
                asyncio.run_coroutine_threadsafe(order_meanwhile(), loop).result()
                return made.to_plan._replace(stamp=clock.now(), verb="formation")

            loop = asyncio.get_running_loop()
            monkeypatch.setattr(operator, "plan_order", plan)
            with pytest.raises(FlightError, match=rf"^formation '': {verb} was ordered meanwhile$"):
                await flight.formation("")
            assert {drone.phase for drone in flight.drones.values()} == {"hold" if verb == "hold" else "ready"}

    asyncio.run(fly())


def test_a_process_that_died_before_the_start_is_why_nobody_starts(opened, children):
    async def fly():
        async with opened() as flight:
            children.dead.append("uav2")
            await flight.sleep(0.2)
            with pytest.raises(FlightError, match=r"^start: uav2 ended unexpectedly"):
                await flight.start()

    asyncio.run(fly())


def test_the_processes_end_with_the_script_whatever_ends_its_conducting(opened, children, monkeypatch):
    ended = []

    async def end(_):
        ended.append("all")

    def unreadable():
        raise OSError("no log to read")

    async def fly():
        with pytest.raises(OSError, match="no log to read"):
            async with opened() as flight:
                monkeypatch.setattr(children, "ended", unreadable)
                await flight.sleep(0.2)
        return tuple(ended)

    monkeypatch.setattr(children, "end", end)
    assert asyncio.run(fly()) == ("all",)


def test_without_a_trace_the_flights_own_failure_is_what_the_script_gets(opened_without_trace):
    async def fly(failure):
        async with opened_without_trace():
            if failure:
                raise failure

    with pytest.raises(FlightError, match=r"there is no report: .*trace\.mcap"):
        asyncio.run(fly(None))
    with pytest.raises(ZeroDivisionError):
        asyncio.run(fly(ZeroDivisionError()))


def test_the_report_is_written_while_the_terminal_is_paused(opened_without_trace, monkeypatch):
    written, before_it_resumed = threading.Event(), []
    monkeypatch.setattr(real, "write_report", lambda *_: written.set())

    async def fly():
        async with opened_without_trace():
            later(lambda: before_it_resumed.append(written.wait(5.0)))

    asyncio.run(fly())
    assert before_it_resumed == [True]


@pytest.mark.long
def test_the_page_s_script_flies_for_real_with_the_same_phases(script, swarm_file):
    text = swarm_file.read_text()
    swarm_file.write_text(f"{text}\n[network]\nbase_port = {free_ports()}\n")
    phases, summary = asyncio.run(script(virtual=False))
    assert phases == ["formation", "formation"]
    assert summary.formation_error_m.max_tail < 0.05
    assert not summary.messages.lost

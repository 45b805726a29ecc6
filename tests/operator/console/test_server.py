"""The console's server with real connections: pages that stop reading, pictures that fail, orders that end a start."""

import asyncio
import socket
import threading
from contextlib import asynccontextmanager

import aiohttp
import pytest
from flockwire_core.wire.phase import Phase
from flockwire_operator.console import command, server
from flockwire_operator.station import operator
from served_pages import TOKEN, serving
from simulated_pilots import SimulatedSwarm, started

HANDSHAKE = (
    "GET /live HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


@pytest.fixture
def swarm(make_plan, monkeypatch):
    """Return a swarm on the ground; pictures come every 0.02 s, and a page has 0.3 s to take one."""
    monkeypatch.setattr(server, "PERIOD", 0.02)
    monkeypatch.setattr(server, "LONGEST_SEND", 0.3)
    return SimulatedSwarm(make_plan())


@asynccontextmanager
async def looking(port):
    """Open a page that may give orders."""
    address = f"http://127.0.0.1:{port}/live?token={TOKEN}"
    async with aiohttp.ClientSession() as session, session.ws_connect(address, max_msg_size=0) as page:
        assert (await page.receive_json())["orders"] is True
        yield page


async def vanished(port):
    """Return a connection that asked for pictures and reads none."""
    silent = socket.socket()
    silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    silent.setblocking(False)
    await asyncio.get_running_loop().sock_connect(silent, ("127.0.0.1", port))
    await asyncio.get_running_loop().sock_sendall(silent, HANDSHAKE.encode())
    return silent


async def answers(page, count):
    """Return the answers to the orders of a page."""
    found = []
    while len(found) < count:
        message = await page.receive_json()
        if "answer" in message:
            found.append(message["answer"])
    return found


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:8420", 200),
        ("localhost:8420", 200),
        ("LOCALHOST", 200),
        ("[::1]:8420", 200),
        ("10.0.0.7:8420", 200),  # an address of this machine, at whichever it listens
        ("station.lab:8420", 200),  # the --address
        ("rebound.example:8420", 403),
        ("127.0.0.1.rebound.example", 403),
        ("[::1].rebound.example:8420", 403),
        ("", 403),
    ],
)
def test_the_console_is_asked_by_its_own_names_alone(swarm, host, status):
    async def run():
        async with serving(swarm, "station.lab") as (_, port), aiohttp.ClientSession() as session:
            for path in ("/", "/app.js", "/live"):
                async with session.get(f"http://127.0.0.1:{port}{path}", headers={"Host": host}) as answer:
                    assert answer.status == (400 if path == "/live" and status == 200 else status)  # no websocket
                    assert (status == 403) == ("open it by its IP address" in await answer.text())

    asyncio.run(run())


def test_a_page_that_has_vanished_keeps_no_picture_from_the_others_and_its_connection_ends(swarm, monkeypatch):
    async def run():
        async with serving(swarm) as (pages, port), looking(port) as page, asyncio.timeout(10):
            filling = {"filling": 2**20 * "x"}  # no buffer takes many of these
            monkeypatch.setattr(server, "snapshot", lambda *_: filling)
            silent = await vanished(port)
            while len(pages._pages) < 2:
                await page.receive_json()
            loop, longest = asyncio.get_running_loop(), 0.0
            while len(pages._pages) == 2:
                before = loop.time()
                await page.receive_json()
                longest = max(longest, loop.time() - before)
            silent.close()
            assert longest < server.LONGEST_SEND
            assert pages._pages
            await page.receive_json()

    asyncio.run(run())


def test_a_picture_that_cannot_be_made_is_logged_once_and_the_next_one_is_sent(swarm, caplog, monkeypatch):
    async def run():
        async with serving(swarm) as (_, port), looking(port) as page, asyncio.timeout(10):
            made, calls = server.snapshot, []

            def snapshot(*given):
                calls.append(given)
                if len(calls) < 5:
                    raise ZeroDivisionError
                return made(*given)

            monkeypatch.setattr(server, "snapshot", snapshot)
            while len(calls) < 5:
                await page.receive_json()

    asyncio.run(run())
    (record,) = [record for record in caplog.records if record.name == "console"]
    assert record.exc_info[0] is ZeroDivisionError


@pytest.mark.parametrize("verb", ["hold", "land", "stop"])
def test_an_order_ends_a_start_that_is_under_way(swarm, verb, monkeypatch):
    swarm["uav2"].phase, swarm["uav2"].stays = Phase.GROUNDED, True

    async def run():
        async with serving(swarm) as (_, port), looking(port) as page, asyncio.timeout(10):
            await page.send_json({"order": "start"})
            await asyncio.sleep(0.2)
            for pilot in swarm.pilots.values():
                pilot.deaf = True  # so that no status names the order
            await page.send_json({"order": verb})
            (start,) = await answers(page, 1)
            swarm["uav2"].phase = Phase.READY  # a start that still waited would take off
            await asyncio.sleep(0.3)
            return start

    assert asyncio.run(run()) == {"order": "start", "failed": "another order was given meanwhile", "note": ""}
    assert swarm.orders == [verb]


@pytest.mark.parametrize("verb", ["hold", "land", "stop"])
def test_an_order_waits_for_no_plan_of_a_change_and_ends_it(make_plan, verb, monkeypatch):
    swarm = SimulatedSwarm(make_plan({"formations.wide": {"kind": "circle", "radius": 4.0}}))
    swarm.all(Phase.FORMATION, started())
    began, ends = threading.Event(), threading.Event()

    def plan(*_):
        began.set()
        ends.wait(60.0)
        raise ValueError("too late")

    monkeypatch.setattr(operator, "plan_order", plan)

    async def run():
        async with serving(swarm) as (_, port), looking(port) as page, asyncio.timeout(10):
            await page.send_json({"order": "formation", "formation": "wide"})
            while not began.is_set():  # noqa: ASYNC110  (a thread sets it)
                await asyncio.sleep(0.01)
            await page.send_json({"order": verb})
            found = await answers(page, 2)
            ends.set()
            return found

    change = {"order": "formation", "failed": "another order was given meanwhile", "note": ""}
    assert change in asyncio.run(run())
    assert swarm.orders == [verb]


def test_the_page_keeps_to_its_own_policy(swarm):
    async def run():
        async with serving(swarm) as (_, port), aiohttp.ClientSession() as session:
            page = await session.get(f"http://127.0.0.1:{port}/")
            return await page.text(), page.headers["Content-Security-Policy"].split("; ")

    text, policy = asyncio.run(run())
    assert '<link rel="icon" href="data:,">' in text
    assert "img-src 'self' data:" in policy


def test_a_failure_that_comes_back_is_logged_again(caplog):
    async def work():
        calls.append(len(calls))
        if len(calls) == 3:
            await asyncio.sleep(2 * server.PERIOD)
        if len(calls) > 3:
            raise asyncio.CancelledError
        raise ValueError("again")

    calls = []
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(server._repeated(work, "cannot work"))
    assert [record.message for record in caplog.records] == ["cannot work"] * 2


@pytest.mark.parametrize("rest", [b"no header", b"A: " + b"x" * 20000, b"Content-Length: -1"])
def test_a_request_that_is_not_http_is_dropped_and_counted(swarm, rest, capsys, caplog):
    async def run():
        async with serving(swarm) as (_, port):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\n" + rest + b"\r\n\r\n")
            answer = await reader.read()
            writer.close()
            return answer

    with command.malformed_counted():
        answer = asyncio.run(run())
    assert b" 400 " in answer.splitlines()[0]
    assert caplog.text == ""
    assert command.MALFORMED.format(count=1) in capsys.readouterr().err


def test_a_port_that_browsers_refuse_is_warned_of(make_plan, monkeypatch, capsys, tmp_path):
    async def unanswered(*_):
        return None

    monkeypatch.setattr(command, "connected", unanswered)
    for port, warned in ((6667, True), (8420, False)):
        assert not asyncio.run(command.serve(make_plan(), tmp_path, "127.0.0.1", port))
        assert (command.UNSAFE_PORT.format(port=port) in capsys.readouterr().err) == warned


def test_pages_without_the_token_keep_no_operator_out(swarm):
    async def crowded():
        async with serving(swarm) as (_, port), aiohttp.ClientSession() as session:
            lookers = [await session.ws_connect(f"http://127.0.0.1:{port}/live") for _ in range(server.MOST_PAGES)]
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await session.ws_connect(f"http://127.0.0.1:{port}/live")
            assert refused.value.status == 503
            async with looking(port):
                assert all(not page.closed for page in lookers)

    asyncio.run(crowded())

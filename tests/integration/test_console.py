"""The console beside a swarm that flies: its page in a real browser, and Foxglove's protocol."""

import asyncio
import re
import subprocess
import sys
import time
from pathlib import Path

import aiohttp
import psutil
import pytest
from chromium import PROGRAM, browser
from fleet import PATIENCE
from flockwire_core.loading import load_swarm
from flockwire_core.wire.plan import Plan
from foxglove_viewer import viewing
from ports import free_ports

pytestmark = pytest.mark.long
SHARE = 0.15  # of a core that the console may take
PHASES = "[...document.querySelectorAll('#rows tr td:nth-child(2)')].map(one => one.textContent)"
README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def begin(folder, *arguments):
    """Start a command; its output goes to a file named by its first argument."""
    with (folder / f"{arguments[0]}.log").open("w") as log:
        line = [sys.executable, "-m", "flockwire_operator", *map(str, arguments)]
        return psutil.Popen(line, cwd=folder, stdout=log, stderr=log)


def link_of(folder, process, scheme="http"):
    """Return the link that the console prints."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        assert process.is_running()
        found = re.search(rf"{scheme}://\S+", (folder / "console.log").read_text())
        if found:
            return found[0]
        time.sleep(0.1)
    raise AssertionError((folder / "console.log").read_text())


@pytest.fixture
def flying(tmp_path):
    """Start a swarm and its console; yields the folder, a function that starts the console, and its link."""
    base, text = free_ports(), re.search(r"```toml\n(.*?)```", README, re.DOTALL)[1]
    (tmp_path / "mine.toml").write_text(f"{text}\n[network]\nbase_port = {base}\n")
    keys = [sys.executable, "-m", "flockwire_operator", "keys", "mine.toml"]
    subprocess.run(keys, cwd=tmp_path, check=True, capture_output=True)
    started = [begin(tmp_path, "up", "mine.toml", "--duration", "0", "--headless", "--out", "out")]

    def console():
        ports = ("--port", base + 30, "--foxglove", base + 31)
        started.append(begin(tmp_path, "console", "mine.toml", *ports))
        return started[-1], link_of(tmp_path, started[-1])

    yield tmp_path, console
    for process in reversed(started):
        if process.is_running():
            process.terminate()
    psutil.wait_procs(started, timeout=PATIENCE)


@pytest.mark.skipif(PROGRAM is None, reason="there is no chromium")
def test_the_page_shows_the_flight_and_is_obeyed(flying):
    folder, console = flying
    process, link = console()

    async def look():
        async with browser(folder / "profile") as page:
            await page.open(link)
            await page.until(f"({PHASES}).length === 4 && ({PHASES}).every(one => one === 'formation')")
            before = await page.value("JSON.stringify(picture.drones[1].position)")
            await page.until(f"JSON.stringify(picture.drones[1].position) !== '{before}'")  # the map moves
            await page.value("document.querySelector('[data-order=hold]').click()")
            await page.until(f"({PHASES}).every(one => one === 'hold')")

            process.terminate()  # the console is restarted, with a new token: the old page may look, not order
            process.wait(PATIENCE)
            _, again = console()
            await page.until("document.getElementById('state').textContent.includes('not connected')")
            await page.open(again)
            await page.until("document.getElementById('state').textContent === 'connected'")

            await page.resize(390, 844, True)
            await page.until("document.body.scrollWidth <= innerWidth && innerWidth === 390")
            sizes = "[...document.querySelectorAll('footer button')].map(one => one.getBoundingClientRect())"
            assert await page.value(f"{sizes}.every(box => box.height >= 44 && box.bottom <= innerHeight)")

            await page.resize(1280, 800, False)
            await page.value("socket.send(JSON.stringify({order: 'stop'}))")
            await page.until(f"({PHASES}).every(one => one === 'stopped')", 10.0)

    asyncio.run(look())


def test_a_wrong_token_is_refused_and_none_may_look_but_not_order(flying):
    _, console = flying
    process, link = console()
    host = link.split("#")[0].removeprefix("http://").rstrip("/")

    async def attack():
        async with aiohttp.ClientSession() as session:
            with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
                await session.ws_connect(f"http://{host}/live?token=guess")
            with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
                await session.ws_connect(f"http://{host}/live", headers={"Origin": "http://elsewhere.example"})
            async with session.ws_connect(f"http://{host}/live") as socket:
                assert (await socket.receive_json())["orders"] is False
                while True:
                    drones = (await socket.receive_json())["drones"]
                    if len(drones) == 4 and all(drone["phase"] == "formation" for drone in drones.values()):
                        break
                await socket.send_json({"order": "stop"})
                for _ in range(20):
                    drones = (await socket.receive_json())["drones"]
                assert all(drone["phase"] == "formation" for drone in drones.values())

    asyncio.run(attack())
    process.cpu_percent()
    time.sleep(3.0)
    assert process.cpu_percent() / 100.0 < SHARE


def test_foxglove_decodes_every_topic_of_a_flight(flying):
    folder, console = flying
    process, _ = console()
    plan = Plan(load_swarm(folder / "mine.toml"))
    topics = {f"/{plan.text(key)}" for key in plan.subscribes["console"]}

    async def look():
        async with viewing(link_of(folder, process, "ws")) as viewer:
            await viewer.until(lambda: viewer.topics == topics)
            await viewer.until(lambda: {seen.topic for seen in viewer.seen} == topics, PATIENCE)
            before = len(viewer.seen)
            await viewer.until(lambda: len(viewer.seen) > before + 10 * len(topics), PATIENCE)
            return viewer

    viewer = asyncio.run(look())
    told = [(seen, viewer.decoded(seen)) for seen in viewer.seen]
    statuses = {seen.topic: message for seen, message in told if seen.topic.endswith("/status")}
    assert {topic: message.identity for topic, message in statuses.items()} == {
        f"/{plan.swarm.name}/{identity}/status": identity for identity in plan.started
    }
    assert statuses[f"/{plan.swarm.name}/uav1/status"].position_known
    assert all(0 <= seen.time - message.header.stamp.sec * 10**9 < 2 * 10**9 for seen, message in told)

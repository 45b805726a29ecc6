"""The console's page in a real browser, beside a simulated swarm."""

import asyncio
import json

import pytest
from chromium import PROGRAM, browser
from flockwire_core.domain.time import SECOND
from flockwire_operator.console import picture
from flockwire_operator.console.server import OTHER_LINK
from served_pages import TOKEN, serving
from simulated_pilots import SimulatedSwarm

pytestmark = [pytest.mark.long, pytest.mark.skipif(PROGRAM is None, reason="there is no chromium")]
REFUSED = f"not connected: {OTHER_LINK}"
STATE = "document.getElementById('state')"


def test_a_page_without_new_pictures_says_for_how_long_until_they_come_again(make_plan, tmp_path):
    async def look():
        async with serving(SimulatedSwarm(make_plan())) as (pages, port), browser(tmp_path / "profile") as page:
            await page.open(f"http://127.0.0.1:{port}/#{TOKEN}")
            await page.until(f"picture && {STATE}.textContent === 'connected'")
            shown, pages._pages = pages._pages, []
            await page.until(f"/no picture for [12] s/.test({STATE}.textContent) && {STATE}.classList.contains('bad')")
            pages._pages = shown
            await page.until(f"{STATE}.textContent === 'connected' && !{STATE}.classList.contains('bad')")

    asyncio.run(look())


def test_a_wrong_token_and_a_console_that_was_restarted_are_named(make_plan, tmp_path):
    async def look():
        swarm = SimulatedSwarm(make_plan())
        async with browser(tmp_path / "profile") as page:
            async with serving(swarm) as (pages, port):
                await page.open(f"http://127.0.0.1:{port}/#guess")
                await page.until(f"{STATE}.textContent === {REFUSED!r} && {STATE}.classList.contains('bad')")
                await page.open(f"http://127.0.0.1:{port}/#{TOKEN}")
                await page.until(f"{STATE}.textContent === 'connected'")
                pages._token = "another"  # as a console has that was restarted
                await page.value("socket.close()")
                await page.until(f"{STATE}.textContent === {REFUSED!r}")
            await page.until(f"{STATE}.textContent === 'not connected'")

    asyncio.run(look())


def test_who_reports_nothing_is_named_beside_connected(make_plan, tmp_path, monkeypatch):
    monkeypatch.setattr(picture, "STALE", SECOND // 5)

    async def look():
        swarm = SimulatedSwarm(make_plan())
        async with serving(swarm) as (_, port), browser(tmp_path / "profile") as page:
            await page.open(f"http://127.0.0.1:{port}/#{TOKEN}")
            await page.until(f"{STATE}.textContent === 'connected' && !{STATE}.classList.contains('bad')")
            swarm["uav2"].silent = True
            await page.until(f"{STATE}.textContent === 'connected; silent: uav2' && {STATE}.classList.contains('bad')")
            for pilot in swarm.pilots.values():
                pilot.silent = True
            swarm.message = lambda *_: None
            await page.until(
                f"{STATE}.textContent === 'connected; no process reports: the swarm has ended, or cannot be reached'"
            )

    asyncio.run(look())


def test_no_trail_is_drawn_across_missing_pictures_or_positions(make_plan, tmp_path):
    async def look():
        async with serving(SimulatedSwarm(make_plan())) as (_, port), browser(tmp_path / "profile") as page:
            await page.open(f"http://127.0.0.1:{port}/#{TOKEN}")
            await page.until(f"picture && {STATE}.textContent === 'connected'")
            await page.value("socket.onmessage = null")
            drone = {"phase": "hold", "detail": "", "battery": 1, "error": -1, "formation": None, "place": None}
            shown = [(0.0, 0.0, 1.0), (1.0, 0.0, 1.0), None, (2.0, 1.0, 1.0), "late", (3.0, 1.0, 1.0)]
            await page.value("samples.clear()")
            for k, at in enumerate(shown):
                if at == "late":
                    await page.value("newest -= 2000")
                    continue
                sent = {"now": k / 10, "mission": None, "drones": {1: {**drone, "position": at}}, "others": {}}
                await page.value(f"take({json.dumps(sent)})")
            lines = (
                "(() => { let drawn = []; shape({beginPath() {}, stroke() {}, setLineDash() {}, "
                "moveTo(x) { drawn.push('move ' + x); }, lineTo(x) { drawn.push('line ' + x); }}, "
                "trails().get(1), 'red', [], false); return drawn.join(', '); })()"
            )
            assert await page.value(lines) == "move 0, line 1, move 2, move 3"

    asyncio.run(look())


def test_a_zoomed_map_stays_while_pictures_arrive_until_the_drones_are_asked_for(make_plan, tmp_path):
    async def look():
        async with serving(SimulatedSwarm(make_plan())) as (_, port), browser(tmp_path / "profile") as page:
            await page.resize(1280, 800, False)
            await page.open(f"http://127.0.0.1:{port}/#{TOKEN}")
            await page.until(f"picture && {STATE}.textContent === 'connected'")
            await page.value("socket.onmessage = null")
            drone = {"phase": "hold", "detail": "", "battery": 1, "error": -1, "formation": None, "place": None}

            async def shown(x):
                sent = {"now": x, "mission": x, "drones": {1: {**drone, "position": (x, 0.0, 1.0)}}, "others": {}}
                await page.value(f"take({json.dumps(sent)}); draw()")
                return await page.value("scene.camera.target[0]")

            assert await shown(1.0) == pytest.approx(1.0)
            assert await page.value("document.querySelector('#clock b').textContent") == "t = 1.0 s"
            before = await page.value("scene.camera.scale")
            wheel = {"type": "mouseWheel", "x": 300, "y": 300, "deltaX": 0, "deltaY": -300}
            await page.call("Input.dispatchMouseEvent", **wheel)
            await page.until(f"scene.camera.scale > 1.3 * {before}")
            zoomed = await page.value("scene.camera.target[0]")
            assert await shown(2.0) == zoomed
            await page.value("document.querySelector('[data-fit=follow]').click()")
            assert await shown(3.0) == pytest.approx(3.0)

    asyncio.run(look())


def test_a_drone_s_sheet_is_opened_by_the_keyboard_and_stays_open_while_pictures_arrive(make_plan, tmp_path):
    async def look():
        async with serving(SimulatedSwarm(make_plan())) as (_, port), browser(tmp_path / "profile") as page:
            await page.open(f"http://127.0.0.1:{port}/#{TOKEN}")
            await page.until(f"picture && {STATE}.textContent === 'connected'")
            await page.value("document.querySelector('button.name[data-id=\"2\"]').focus()")
            await page.value("window.before = picture.now")
            await page.until("picture.now > before + 0.3")
            for kind in ("keyDown", "keyUp"):
                await page.call("Input.dispatchKeyEvent", type=kind, key="Enter", code="Enter", text="\r")
            await page.until("document.querySelectorAll('#rows .sheet').length === 1")
            await page.value("window.before = picture.now")
            await page.until("picture.now > before + 0.3")
            assert await page.value("document.activeElement.dataset.id") == "2"
            assert "no reason reported" in await page.value("document.querySelector('#rows .sheet').textContent")

    asyncio.run(look())

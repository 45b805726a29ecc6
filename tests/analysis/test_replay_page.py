"""The replay page in a real browser: its slider, its clock, its views."""

import asyncio

import pytest
from chromium import PROGRAM, browser
from flockwire_analysis.reading import read_trace
from flockwire_analysis.replay import write_replay
from flockwire_analysis.summary import summarise

pytestmark = [pytest.mark.long, pytest.mark.skipif(PROGRAM is None, reason="there is no chromium")]
CLOCK = "document.querySelector('#clock b').textContent"
PICTURE = "document.getElementById('canvas').toDataURL()"


@pytest.fixture(scope="module")
def link(tmp_path_factory, write_flight):
    folder = tmp_path_factory.mktemp("page")
    write_flight(folder / "trace.mcap", begin=-2.0, end=6.0)
    trace = read_trace(folder / "trace.mcap")
    return write_replay(trace, summarise(trace), folder / "replay.html").as_uri()


def looking(link, folder, look):
    """Open the page, and look at it."""

    async def run():
        async with browser(folder / "profile") as page:
            await page.resize(1280, 800, False)
            await page.open(link)
            await page.until(f"{CLOCK} === 't = 0.00 s'")
            await look(page)

    asyncio.run(run())


async def drawn(page, action):
    """Return the drawing after an action, when the next frame was drawn."""
    await page.value(
        f"window.done = false; {action}; requestAnimationFrame(() => requestAnimationFrame(() => done = true))"
    )
    await page.until("done")
    return await page.value(PICTURE)


def test_the_slider_moves_the_clock_the_table_and_the_drones(link, tmp_path):
    async def look(page):
        before = await page.value(PICTURE)
        slider = "const s = document.getElementById('slider')"
        after = await drawn(page, f"{{ {slider}; s.value = 200; s.dispatchEvent(new Event('input')); }}")
        assert await page.value(CLOCK) == "t = 2.02 s"
        assert after != before
        shown = await page.value("document.querySelector('#rows tr:nth-child(2) td:nth-child(4)').textContent")
        at = await page.value("[0, 1].map((k) => flight.drones[1].position[k][200] / 1000)")
        assert [float(one) for one in shown.split(",")] == pytest.approx(at, abs=0.0051)
        await page.value(
            "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}))"
        )
        assert await page.value(CLOCK) == "t = 2.04 s"

    looking(link, tmp_path, look)


def test_it_opens_at_the_start_of_the_formation_with_every_drone(link, tmp_path):
    async def look(page):
        cells = "[...document.querySelectorAll('#rows tr td:nth-child({}) ')].map((one) => one.textContent)"
        assert set(await page.value(cells.format(2))) <= {"formation", "hold"}
        errors = await page.value(cells.format(7))
        assert errors[0] == ""
        assert all(error.isdecimal() for error in errors[1:])  # positions are in whole mm
        assert await page.value("flight.drones[1].position[0][0] !== null")

    looking(link, tmp_path, look)


def test_the_list_of_events_follows_the_flight(link, tmp_path):
    async def look(page):
        await page.value(
            "flight.marks = Array.from({length: 90}, (_, k) => ({t: k / 20, kind: 'order', text: `${k}`}))"
        )
        await page.value("document.getElementById('events').replaceChildren(); fill(); seek(4.0)")
        now, height = "document.querySelector('#events .now')", "document.getElementById('events').clientHeight"
        top = await page.value(f"{now}.offsetTop - document.getElementById('events').scrollTop")
        assert await page.value(f"{now}.textContent.endsWith('80')")
        assert 0 <= top <= await page.value(height)
        assert await page.value("document.getElementById('side').scrollTop") == 0

    looking(link, tmp_path, look)


def test_it_plays_to_the_end_at_the_chosen_speed_and_jumps_to_marks(link, tmp_path):
    async def look(page):
        await page.value("document.getElementById('speed').value = 20; document.getElementById('play').click()")
        await page.until("document.getElementById('play').textContent === 'Play' && now === end")
        await page.value(
            "[...document.querySelectorAll('#events button')].find(b => b.textContent.includes('start')).click()"
        )
        assert await page.value(CLOCK) == "t = 0.00 s"
        worst = await page.value("flight.moments[0].t")
        await page.value(
            "{ const m = document.getElementById('moments'); m.value = 0; m.dispatchEvent(new Event('change')); }"
        )
        assert await page.value(CLOCK) == f"t = {worst:.2f} s"
        await page.value("location.hash = '#t=3.5'")
        await page.until(f"{CLOCK} === 't = 3.50 s'")

    looking(link, tmp_path, look)


def test_views_zoom_and_pan_change_the_drawing_and_a_phone_shows_all(link, tmp_path):
    async def look(page):
        seen = {await page.value(PICTURE)}
        for action in ("[data-view=side]", "[data-view=\\'3-D\\']", "[data-fit=field]", "[data-zoom]"):
            seen.add(await drawn(page, f"document.querySelector('{action}').click()"))
        pointer = {"x": 300, "y": 400, "button": "left", "buttons": 1, "clickCount": 1}
        await page.call("Input.dispatchMouseEvent", type="mousePressed", **pointer)
        await page.call("Input.dispatchMouseEvent", type="mouseMoved", **{**pointer, "x": 400})
        await page.call("Input.dispatchMouseEvent", type="mouseReleased", **{**pointer, "x": 400})
        seen.add(await drawn(page, "0"))
        assert len(seen) == 6
        assert await page.value("scene.camera.yaw") == pytest.approx(-0.55 - 0.8)
        await page.resize(390, 844, True)
        await page.until("document.body.scrollWidth <= innerWidth && innerWidth === 390")
        boxes = "[...document.querySelectorAll('footer button, footer select')].map(one => one.getBoundingClientRect())"
        assert await page.value(f"{boxes}.every(box => box.height >= 44 && box.bottom <= innerHeight)")

    looking(link, tmp_path, look)


def test_a_moving_body_is_drawn_while_it_is_sensed_and_no_button_covers_a_drone(link, tmp_path):
    async def look(page):
        await page.value("const at = Math.round(index(2))")
        without = await drawn(page, "seek(2)")
        assert await drawn(page, "flight.movers = [[at, [[2000, 500, 300, null]]]]; draw()") != without
        (body,) = await page.value("moversAt(2.1)")
        assert body == {"center": [2, 0.5], "radius": 0.3, "height": None}
        assert await page.value("moversAt(2.5)") == await page.value("moversAt(1.5)") == []
        await page.resize(390, 844, True)
        await drawn(page, "scene.camera.keep('flight')")
        lowest = await page.value("document.querySelector('.tools').getBoundingClientRect().bottom")
        top = await page.value("document.getElementById('canvas').getBoundingClientRect().top")
        highest = await page.value("Math.min(...flown.map((point) => scene.camera.to(point)[1]))")
        assert top + highest > lowest

    looking(link, tmp_path, look)

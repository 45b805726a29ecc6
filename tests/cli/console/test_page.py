"""The console's page in a real browser, beside a simulated swarm."""

import asyncio

import pytest
from chromium import PROGRAM, browser
from served_pages import TOKEN, serving
from simulated_pilots import SimulatedSwarm

pytestmark = [pytest.mark.long, pytest.mark.skipif(PROGRAM is None, reason="there is no chromium")]
STATE = "document.getElementById('state')"


def test_a_page_without_new_pictures_says_for_how_long_until_they_come_again(make_plan, tmp_path):
    async def look():
        async with serving(SimulatedSwarm(make_plan())) as (pages, port), browser(tmp_path / "profile") as page:
            await page.open(f"http://127.0.0.1:{port}/#{TOKEN}")
            await page.until(f"picture && {STATE}.textContent === 'connected'")
            show, pages._show = pages._show, lambda: None
            await page.until(f"/no picture for [12] s/.test({STATE}.textContent) && {STATE}.classList.contains('bad')")
            pages._show = show
            await page.until(f"{STATE}.textContent === 'connected' && !{STATE}.classList.contains('bad')")

    asyncio.run(look())

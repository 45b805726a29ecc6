"""Drives Debian's Chromium by the DevTools protocol."""

from __future__ import annotations

import asyncio
import json
import shutil
import subprocess
from contextlib import asynccontextmanager

import aiohttp

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser")


class Page:
    """One page of the browser."""

    def __init__(self, socket):
        self._socket, self._count = socket, 0

    async def call(self, method, **parameters):
        """Call a method of the protocol; returns its result."""
        self._count += 1
        await self._socket.send_json({"id": self._count, "method": method, "params": parameters})
        async for message in self._socket:
            answer = json.loads(message.data)
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return answer["result"]
        raise AssertionError("the browser is gone")

    async def open(self, link):
        await self.call("Page.navigate", url="about:blank")  # a link that differs in its fragment alone loads nothing
        await self.call("Page.navigate", url=link)

    async def value(self, expression):
        """Return the value of a JavaScript expression, None while it cannot be had."""
        found = await self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        return found["result"].get("value")

    async def until(self, expression, patience=40.0):
        """Wait until an expression is true."""
        async with asyncio.timeout(patience):
            while not await self.value(expression):  # noqa: ASYNC110  (the page knows no event of ours)
                await asyncio.sleep(0.1)

    async def resize(self, width, height, mobile):
        await self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=mobile
        )


@asynccontextmanager
async def browser(folder):
    """Run the browser with its profile in `folder`; yields its page."""
    line = [PROGRAM, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"]
    line += [f"--user-data-dir={folder}", "about:blank"]
    process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)  # noqa: ASYNC220
    try:
        port = next(
            text.split("127.0.0.1:")[1].split("/")[0] for text in process.stderr if "DevTools listening" in text
        )
        async with aiohttp.ClientSession() as session:
            async with session.get(f"http://127.0.0.1:{port}/json") as answer:
                target = next(one for one in await answer.json() if one["type"] == "page")
            async with session.ws_connect(target["webSocketDebuggerUrl"], max_msg_size=0) as socket:
                yield Page(socket)
    finally:
        process.kill()
        process.wait()

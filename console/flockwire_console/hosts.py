"""The host names that the console accepts: a foreign name may lead here too (DNS rebinding)."""

from __future__ import annotations

import ipaddress
import re
from typing import Any

from aiohttp import web

_HOST = re.compile(r"(?:\[(?P<v6>[^\]]*)\]|(?P<name>[^:]*))(?::\d+)?")


def is_own(host: str, names: frozenset[str]) -> bool:
    """Return whether `host`, a Host header, is an IP address or one of `names`, with any port."""
    found = _HOST.fullmatch(host)
    if found is None:
        return False
    try:
        ipaddress.ip_address(found["v6"] or found["name"])
    except ValueError:
        return (found["name"] or "").lower() in names
    return True


def pinned(address: str) -> Any:  # noqa: ANN401  (aiohttp's)
    """Return a middleware that answers 403 unless the host is an IP address, localhost or `address`."""
    names = frozenset({"localhost", address.lower()})

    @web.middleware
    async def pin(request: web.Request, handler: Any) -> web.StreamResponse:  # noqa: ANN401
        if not is_own(request.headers.get("Host", ""), names):
            raise web.HTTPForbidden(text="the console does not accept this host name; open it by its IP address")
        response: web.StreamResponse = await handler(request)
        return response

    return pin

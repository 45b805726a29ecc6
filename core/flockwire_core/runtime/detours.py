"""Detours: the address of a relay that a process dials instead of a peer's own address.

`FLOCKWIRE_DETOURS` has them, as `gateway=127.0.0.1:40001,uav1=127.0.0.1:40002`. `flockwire up` sets it for processes
whose links a file of faults breaks or slows. A detour does not weaken security: the process that answers must have a
certificate of the swarm for that address, and has only the rights of its identity.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping

DETOURS = "FLOCKWIRE_DETOURS"
_FORM = re.compile(r"(?P<identity>[a-z0-9-]+)=(?P<address>[^\s,=]+:[0-9]{1,5})")


class DetoursError(ValueError):
    """The environment has malformed detours."""


def read_detours(environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return `IP:PORT` by the dialled identity; raises DetoursError."""
    text = environment.get(DETOURS, "")
    matches = [_FORM.fullmatch(part) for part in text.split(",")] if text else []
    found = {match["identity"]: match["address"] for match in matches if match is not None}
    if len(found) < len(matches):
        raise DetoursError(f"{DETOURS} = {text!r}: must be IDENTITY=IP:PORT, several separated by commas")
    return found


def detour_environment(detours: Mapping[str, str]) -> dict[str, str]:
    """Return the environment that passes a process its `detours`, nothing when it has none."""
    return {DETOURS: ",".join(f"{identity}={address}" for identity, address in detours.items())} if detours else {}

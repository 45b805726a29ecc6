"""The rungs of the ladder by name, and which of them a pilot's reason tells of."""

from __future__ import annotations

from collections.abc import Iterator

from flockwire_core.pilot.reactions import SHUTDOWN
from flockwire_core.wire.phase import Phase

REASONS = {  # how the reason of a pilot begins: rung
    "own pose is stale": "own pose: hold",
    "own pose lost": "own pose: land",
    "no leader estimate": "leader estimate: hold",
    "leader estimate lost": "leader estimate: land",
    "the leader is down": "leader down: hold",
    "the leader lost": "leader down: land",
    "nearby bodies are stale": "nearby: hold",
    "telemetry lost": "telemetry: land",
    "emergency stop": "stop",
}
RUNGS = (
    "own pose: zero", "own pose: hold", "own pose: land", "neighbour: dropped", "leader estimate: hold",
    "leader estimate: land", "leader down: hold", "leader down: land", "nearby: slow", "nearby: hold",
    "telemetry: reported", "telemetry: land", "battery: refuses", "battery: land", "fence: inwards", "fence: land",
    "stop", "told to end: hold", "told to end: land", "driver: zero", "driver: land",
)  # fmt: skip


def told(phase: str, detail: str) -> Iterator[str]:
    """Yield the rungs that a pilot's reason tells of."""
    yield from (rung for text, rung in REASONS.items() if detail.startswith(text))
    if detail == SHUTDOWN and phase in (Phase.HOLD, Phase.LANDING):
        yield "told to end: hold" if phase == Phase.HOLD else "told to end: land"
    elif detail.startswith("battery"):
        yield "battery: land" if phase == Phase.LANDING else "battery: refuses"
    elif detail.endswith("outside the fence"):
        yield "fence: land"

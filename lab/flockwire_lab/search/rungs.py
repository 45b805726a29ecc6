"""The rungs of the ladder by name: codes of pilots' reasons (pilot/reactions.py), and what else a flight shows."""

from __future__ import annotations

from flockwire_core.pilot.reactions import HOLD, LAND, TABLE

RUNGS = (
    "own pose: zero", "neighbour: dropped", "nearby: slow", "telemetry: reported", "battery: refuse", "fence: inwards",
    "stop", "driver: zero", "driver: land", *(row.code for row in TABLE if row.reaction in (HOLD, LAND)),
)  # fmt: skip

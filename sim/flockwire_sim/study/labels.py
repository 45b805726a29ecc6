"""Texts of grid points and figures."""

from __future__ import annotations

import json
from collections.abc import Mapping

from pydantic import JsonValue

UNKNOWN = "\N{EN DASH}"


def label(point: Mapping[str, JsonValue]) -> str:
    """Return a grid point as `key=value` pairs, the last word of each key."""
    return ", ".join(f"{key.rpartition('.')[2]}={shown(value)}" for key, value in point.items()) or "all runs"


def shown(value: JsonValue) -> str:
    """Return a value from the grid."""
    return value if isinstance(value, str) else json.dumps(value)


def quantity(value: float | None, unit: str) -> str:
    """Return a figure with its unit, small lengths in mm."""
    if value is None:
        return UNKNOWN
    if unit == "m" and abs(value) < 0.1:
        return f"{value * 1000:.2f} mm"
    return f"{value:.3f} {unit}" if unit == "m" else f"{value:.2f} {unit}"

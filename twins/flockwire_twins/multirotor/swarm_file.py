"""The keys of [airframes.NAME] for a multirotor."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Any, Literal

from flockwire_core.swarm.tables import Model, key
from pydantic import Field
from pydantic.json_schema import SkipJsonSchema


def _column(rows: dict[str, Any], k: int) -> dict[str, Any]:
    return {name: _column(row, k) if isinstance(row, dict) else row[k] for name, row in rows.items()}


def _read() -> dict[str, Any]:
    tables = tomllib.loads(files(__package__).joinpath("models.toml").read_text(encoding="utf-8"))
    columns = tables.pop("crazyflies")
    return {name: _column(columns["figures"], k) for k, name in enumerate(columns["names"])} | tables


MODELS = _read()


class MultirotorInAirframes(Model):
    """The keys of [airframes.NAME] for a multirotor."""

    model: Literal[tuple(MODELS)] = key("cf2x_L250", "a multirotor whose figures are known")  # type: ignore[valid-type]
    rotors: bool = key(False, "simulates a multirotor's rotors, from first principles")
    file: str | None = key(None, "figures of a multirotor, in place of a model")
    frames: SkipJsonSchema[str] = Field("", repr=False)  # the file's text

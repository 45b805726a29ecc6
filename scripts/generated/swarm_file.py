"""The page of all keys of a swarm file (docs/swarm_file.md), from the models."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.outline import Entry, entries, explanation, of_field
from flockwire_core.swarm.schema import default
from flockwire_core.swarm.wording import takes
from pydantic import BaseModel

_HEAD = """# The swarm file

<!-- made by scripts/document from the models in core/flockwire_core/swarm; change those -->

One TOML file describes a whole swarm. `flockwire init` writes one with comments, `flockwire check` names every mistake.
Lengths are metres, times seconds, angles radians; the world frame is ENU with Z up. A key without a default must be
given. In messages and dotted keys, list positions count from 0: `drones.2.start` is the start of the third drone.

An editor that knows TOML and JSON Schema (Even Better TOML, taplo) completes and explains keys: `flockwire init` writes
`.flockwire/swarm.schema.json` and a first line that names it."""


def swarm_file_page() -> str:
    """Return the page."""
    parts = [_HEAD]
    written: set[type[BaseModel]] = set()
    every = list(entries(Swarm))
    for entry in every:
        if entry.model in written:
            continue
        written.add(entry.model)
        tables = dict.fromkeys(other.table for other in every if other.model is entry.model)
        parts += ["", *_section(entry, tuple(tables))]
    return "\n".join(parts) + "\n"


def _section(first: Entry, tables: tuple[str, ...]) -> Iterator[str]:
    """Yield heading, purpose and keys of one table."""
    yield f"## {' and '.join(_heading(table) for table in tables)}{_kind_of(first.model)}"
    yield ""
    yield (first.model.__doc__ or "").strip().split("\n")[0]
    yield ""
    yield "| key | default | unit | must be | |"
    yield "|---|---|---|---|---|"
    for entry in entries(first.model):
        if not entry.table:
            unit, meaning = explanation(entry.model, entry.name)
            cells = f"`{entry.name}`", default(entry), unit, takes(*of_field(entry.field)), meaning
            yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _heading(table: str) -> str:
    if not table:
        return "The top of the file"
    return f"`[[{table.removesuffix('.N')}]]`" if table.endswith(".N") else f"`[{table}]`"


def _kind_of(model: type[BaseModel]) -> str:
    field = model.model_fields.get("kind")
    if field is None or len(get_args(field.annotation)) != 1:
        return ""
    return f', kind = "{get_args(field.annotation)[0]}"'

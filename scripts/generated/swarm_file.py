"""The page of all keys of a swarm file (docs/swarm_file.md), from the models."""

from __future__ import annotations

from collections.abc import Iterator

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.outline import Key, Outline

_HEAD = """# The swarm file

<!-- made by scripts/document from the models in core/flockwire_core/swarm; change those -->

One TOML file describes a whole swarm. `flockwire init` writes one with comments, `flockwire check` names every mistake.
Lengths are metres, times seconds, angles radians; the world frame is ENU with Z up. A key without a default must be
given. In messages and dotted keys, list positions count from 0: `drones.2.start` is the start of the third drone.

An editor that knows TOML and JSON Schema (Even Better TOML, taplo) completes and explains keys: `flockwire init` writes
`.flockwire/swarm.schema.json` and a first line that names it."""


def swarm_file_page() -> str:
    """Return the page."""
    outline = Outline(Swarm)
    sections: dict[str, list[Key]] = {}  # by model
    for key in outline.entries():
        sections.setdefault(key.table["title"], []).append(key)
    return "\n".join([_HEAD, *(line for keys in sections.values() for line in _section(outline, keys))]) + "\n"


def _section(outline: Outline, keys: list[Key]) -> Iterator[str]:
    """Yield heading, purpose and keys of one model."""
    table = keys[0].table
    paths = dict.fromkeys(_heading(key.path) for key in keys)
    yield ""
    yield f"## {' and '.join(paths)}" + (f', kind = "{keys[0].kind}"' if keys[0].kind else "")
    yield ""
    yield table.get("purpose", table["description"]).split("\n")[0]
    yield ""
    yield "| key | default | unit | must be | |"
    yield "|---|---|---|---|---|"
    for key in {key.name: key for key in keys}.values():
        cells = f"`{key.name}`", key.default, key.unit, outline.takes(key.part), key.meaning
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _heading(path: str) -> str:
    if not path:
        return "The top of the file"
    return f"`[[{path.removesuffix('.N')}]]`" if path.endswith(".N") else f"`[{path}]`"

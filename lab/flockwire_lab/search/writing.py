"""The files of a search: for each flight to look at a swarm file, a file of faults, the command that flies it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flockwire_core.swarm.reading import read_toml
from flockwire_core.swarm.wording import InputError

from flockwire_lab.search.corpus import Again
from flockwire_lab.search.flight import Case, Judged, Mode, worst_of
from flockwire_lab.study.findings import write_flight


def write_case(case: Case, stem: Path) -> str:
    """Write STEM.toml and STEM.faults.toml; returns the command that flies them. Raises OSError."""
    stem.parent.mkdir(parents=True, exist_ok=True)
    swarm, faults = write_flight(case.table, {"faults": case.faults}, stem)
    mode = " --liveness" if case.mode == "liveness" else ""
    return f"flockwire study {swarm} --replay {faults} --seed {case.seed} --duration {case.duration:g}{mode}"


def read_case(table: dict[str, Any], faults: Path, seed: int, duration: float, mode: Mode) -> Case:
    """Return the flight of a swarm file's content and a file of faults; raises InputError."""
    listed = read_toml(faults, "faults", InputError).get("faults", [])
    if not isinstance(listed, list) or not all(isinstance(fault, dict) for fault in listed):
        raise InputError(f"{faults}: faults: must be a list of tables")
    return Case(table, listed, seed, duration, mode)


def write_search(
    found: Mapping[int, Judged], commands: dict[str, str], shrunk: dict[str, str], again: Again, out: Path
) -> None:
    """Write search.json: the least margin of each property, commands of worst and shrunk flights, the corpus again."""
    worst = worst_of(found)
    least = {name: found[number].margins[name] for name, number in worst.items()}
    content = {
        "flights": len(found),
        "refused": sum(bool(judged.refused) for judged in found.values()),
        "violating": sum(bool(judged.violations) for judged in found.values()),
        "cells": len({judged.cell for judged in found.values() if judged.margins}),
        "least": {
            name: {"margin": one.value, "flight": worst[name], "what": one.what, "command": commands.get(name, "")}
            for name, one in least.items()
        },
        "violations": shrunk,
        "corpus": {"flown": again.flown, "changed": again.changed, "worse": again.worse},
    }
    (out / "search.json").write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")

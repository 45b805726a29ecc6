"""Flies swarms for 14 s of virtual time each, and writes their traces: python scripts/traces.py FOLDER SWARM...

A flight that fails a check of its own is named, and ends it with status 1. No figure is drawn.
"""

from __future__ import annotations

import sys
from pathlib import Path

from flockwire_analysis.reading import read_trace
from flockwire_analysis.summary import summarise
from flockwire_core.loading import load_swarm
from flockwire_lab.flight import Flight, fly_recorded

DURATION = 14.0  # s, the settling of all and a tail


def main(folder: Path, files: list[Path]) -> int:
    """Fly each of `files`; returns the exit status."""
    failed = 0
    folder.mkdir(parents=True)
    for file in files:
        trace = folder / f"{file.stem}.mcap"
        outcome = fly_recorded(Flight(load_swarm(file), 0, DURATION), file.read_text(), trace, lambda _: None)
        for failure in filter(None, (outcome.failure, *summarise(read_trace(trace)).failures())):
            print(f"{file}: {failure}", file=sys.stderr)
            failed = 1
    return failed


if __name__ == "__main__":
    folder, *files = (Path(argument) for argument in sys.argv[1:])
    sys.exit(main(folder, files))

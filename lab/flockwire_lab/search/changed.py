"""The marks near a change of the code: flights that reach them are the likeliest to show what it broke.

Selecting tests by what a change touches is regression test selection (Rothermel and Harrold, 1996); here the marks of
domain/marks.txt take the place of the lines that a test covers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from flockwire_lab.coverage import declared

FAR, NEAR = 1, 2  # weights: in the file, or in its folder if it has none; the nearest ones to the changed line
_LITERAL = re.compile(r'"([a-z][a-z ]*: [^"]+)"')


def near(file: Path, line: int) -> Mapping[str, int]:
    """Return the marks in `file`, nearest to its changed `line`, by weight; without any those of its folder."""
    gaps: dict[str, int] = {}  # lines between each mark and the change, where it is named most nearly
    for mark, at in _marks(file):
        gaps[mark] = min(abs(at - line), gaps.get(mark, abs(at - line)))
    if not gaps:
        return {mark: FAR for other in sorted(file.parent.rglob("*.py")) for mark, _ in _marks(other)}
    least = min(gaps.values())
    return {mark: NEAR if gap == least else FAR for mark, gap in gaps.items()}


def _marks(file: Path) -> Iterator[tuple[str, int]]:
    """Yield the marks that a file names, and the lines; the names may have fields, as f-strings have."""
    if file.suffix != ".py":
        return
    for number, text in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        for literal in _LITERAL.findall(text):
            form = re.compile(".*".join(map(re.escape, re.split(r"\{[^}]*\}", literal))))
            yield from ((mark, number) for mark in declared() if form.fullmatch(mark))

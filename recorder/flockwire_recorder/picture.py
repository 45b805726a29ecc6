"""A figure on disk."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure on disk and what it shows."""

    path: Path
    title: str
    caption: str

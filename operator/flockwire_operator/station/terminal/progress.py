"""The progress of a command: a bar on the terminal's standard error, removed at the end."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from flockwire_operator.station.terminal.keyboard import foreground

Show = Callable[[str, float], None]  # takes the current task, and its progress


@contextlib.contextmanager
def progress(text: str, total: float | None = None) -> Iterator[Show]:
    """Show `text` and a bar up to `total` (None: unknown) during the context, in the foreground of a terminal."""
    console = Console(stderr=True)
    off = not console.is_terminal or console.is_dumb_terminal or not foreground(sys.stderr)
    columns = TextColumn("flockwire: {task.description}", markup=False), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True, disable=off) as shown:
        task = shown.add_task(text, total=total)
        yield lambda now, done: shown.update(task, description=now, completed=done)

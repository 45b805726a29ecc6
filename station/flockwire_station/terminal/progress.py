"""How far a command is that takes a while: a bar on the terminal's standard error, gone when it is done."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

Show = Callable[[str, float], None]  # takes what is done now, and how much of the total


@contextlib.contextmanager
def progress(text: str, total: float | None = None) -> Iterator[Show]:
    """Show `text` and a bar up to `total` (None: not known) while the context lasts; nothing without a terminal."""
    console = Console(stderr=True)
    off = not console.is_terminal or console.is_dumb_terminal
    columns = TextColumn("flockwire: {task.description}", markup=False), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True, disable=off) as shown:
        task = shown.add_task(text, total=total)
        yield lambda now, done: shown.update(task, description=now, completed=done)

"""What `up` shows while it flies: the live table, or without a terminal one line for each new stage."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from flockwire import clock
from flockwire.flight.director import Director
from flockwire.nanoseconds import BILLION
from rich.console import Console
from rich.live import Live

from flockwire_cli.keyboard import HINT
from flockwire_cli.operator import Operator
from flockwire_cli.table import Rates, draw


class Display:
    """Shows the processes `order` of the swarm called `name`; a terminal that is gone is no error."""

    def __init__(self, name: str, order: tuple[str, ...], director: Director, headless: bool) -> None:
        self._name, self._order, self._director = name, order, director
        self._rates = Rates()
        self._console = Console()
        self._headless = headless or not self._console.is_terminal
        self._live: Live | None = None
        self._stage = ""
        self._began = clock.now()

    def begin(self, out: Path) -> None:
        """Print what flies, and where its trace goes."""
        if self._headless:
            with contextlib.suppress(OSError):
                print(f"flockwire: {self._name}, {len(self._order)} processes, into {out}", flush=True)

    @contextlib.contextmanager
    def shown(self) -> Iterator[None]:
        """Show it for as long as the context lasts."""
        if self._headless:
            yield
            return
        with contextlib.suppress(OSError), Live(console=self._console, refresh_per_second=4) as self._live:
            yield

    def update(self, operator: Operator, now: int) -> None:
        """Show what is known at `now`."""
        seconds, stage = (now - self._began) / BILLION, self._director.stage
        with contextlib.suppress(OSError):
            if self._live is not None:
                title = f"{self._name}: {stage}, {seconds:.0f} s   ({HINT})"
                self._live.update(draw(title, self._order, operator.statuses, self._rates, now))
            elif self._stage != stage:
                print(f"flockwire: {seconds:5.1f} s  {stage}", flush=True)
        self._stage = stage

"""What `up` and `conduct` show while they fly: the live table, or without a terminal one line for each new stage."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from flockwire import clock
from flockwire.flight.director import Director
from flockwire.nanoseconds import BILLION
from flockwire.wire.plan import Plan
from rich.console import Console
from rich.live import Live

from flockwire_cli.keyboard import hint
from flockwire_cli.operator import Operator
from flockwire_cli.table import Rates, draw

SERVING = "serving"  # what a host does that does not conduct the flight


class Display:
    """Shows the processes `order` of a swarm and the stage of `director`, None where another host conducts.

    A terminal that is gone is no error.
    """

    def __init__(self, plan: Plan, order: tuple[str, ...], director: Director | None, headless: bool) -> None:
        self._plan, self._name, self._order, self._director = plan, plan.swarm.name, order, director
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

    def note(self, event: str) -> None:
        """Print a line about an `event` of now, above the table while that shows."""
        with contextlib.suppress(OSError):
            self._console.print(self._line(event, clock.now()), highlight=False, markup=False, soft_wrap=True)

    def update(self, operator: Operator, now: int) -> None:
        """Show what is known at `now`."""
        stage = self._director.stage if self._director is not None else SERVING
        with contextlib.suppress(OSError):
            if self._live is not None:
                title = f"{self._name}: {stage}, {(now - self._began) / BILLION:.0f} s   ({hint()})"
                self._live.update(draw(title, self._plan, self._order, operator.statuses, self._rates, now))
            elif self._stage != stage:
                print(self._line(stage, now), flush=True)
        self._stage = stage

    def _line(self, event: str, now: int) -> str:
        return f"flockwire: {(now - self._began) / BILLION:5.1f} s  {event}"

"""The output of `up` and `conduct` in flight: the live table, or a line for each new stage.

Lines are for outputs without a terminal, for processes in its background (`up … &`), and for terminals that cannot move
the cursor (TERM=dumb). Nothing here waits for the reader (runtime/standard_streams.py): the next table is drawn after
the terminal has accepted the last one.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.order import Version
from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.standard_streams import busy, later
from flockwire_core.swarm.wording import printable
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from rich.console import Console
from rich.live import Live

from flockwire_operator.station.operator import Operator
from flockwire_operator.station.terminal.keyboard import foreground, hint
from flockwire_operator.station.terminal.table import Rates, draw

REFRESH = SECOND // 4  # ns between two tables
ELSEWHERE = "another station ordered: {order}"
SERVING = "serving"  # the stage of a host that does not conduct the flight


class Display:
    """Shows the processes `order` of a swarm and the stage of the flight; t = 0 is the start of the formation."""

    def __init__(self, plan: Plan, order: tuple[str, ...], headless: bool) -> None:
        self._plan, self._name, self._order = plan, plan.swarm.name, order
        self._rates = Rates()
        self._console = Console()
        self._headless = headless or self._console.is_dumb_terminal or not foreground(sys.stdout)
        self._live: Live | None = None
        self._stage = ""
        self._followed: Version | None = None  # of the newest order of another station
        self._zero: int | None = None  # time 0 of the flight, Unix ns
        self._drawn = 0

    def begin(self, out: Path) -> None:
        """Print the swarm and the trace's folder."""
        if self._headless:
            print(f"flockwire: {self._name}, {len(self._order)} processes, into {out}", flush=True)

    @contextlib.contextmanager
    def shown(self) -> Iterator[None]:
        """Show it during the context."""
        if self._headless:
            yield
            return
        self._live = Live(console=self._console, auto_refresh=False)
        self._live.start()
        try:
            yield
        finally:
            later(self._live.stop)

    def note(self, event: str) -> None:
        """Print a line about an `event`, above the table if it is shown."""
        line = self._line(event, clock.now())
        later(lambda: self._console.print(line, highlight=False, markup=False, soft_wrap=True))

    def update(self, operator: Operator, now: int) -> None:
        """Show the state of `operator` at `now`."""
        director, stage, followed = operator.core.director, SERVING, None
        if director is not None:
            stage, followed, self._zero = director.stage, director.followed, director.formation_start
        changed, self._stage = stage != self._stage, stage
        if self._live is None:
            if changed:
                print(self._line(stage, now), flush=True)
        elif (changed or now - self._drawn >= REFRESH) and not busy():
            self._drawn = now
            later(partial(self._draw, self._live, stage, dict(operator.statuses), now))
        if followed is not None and followed.version != self._followed:
            self._followed = followed.version
            self.note(ELSEWHERE.format(order=f"{followed.verb} {followed.formation}".rstrip()))

    def _draw(self, live: Live, stage: str, statuses: dict[str, Status], now: int) -> None:
        time = "" if self._zero is None else f", t = {(now - self._zero) / SECOND:.0f} s"
        title = f"{self._name}: {stage}{time}   ({hint()})"
        live.update(draw(title, self._plan, self._order, statuses, self._rates, now), refresh=True)

    def _line(self, event: str, now: int) -> str:
        time = "" if self._zero is None else f"t = {(now - self._zero) / SECOND:.1f} s: "
        return f"flockwire: {time}{printable(event)}"

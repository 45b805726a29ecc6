"""The table of reactions: what a pilot does about an input that it loses, or a limit that it leaves.

At each step the first row of each reaction counts whose input is beyond its limit, in a phase that it names. A new
reaction is a row; a new input is a name of INPUTS and its value in `Pilot`. docs/concepts/phases.md prints both.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import Final

from flockwire_core.domain.record import Frozen
from flockwire_core.swarm.model import uav
from flockwire_core.swarm.tables import Limits
from flockwire_core.wire.phase import PILOT_PHASES, Phase
from flockwire_core.wire.status import Reason

NO_REASON: Final = Reason("", "")
REFUSE: Final = "refuse"
HOLD: Final = "hold"
LAND: Final = "land"
SLOW: Final = "slow"
BLIND: Final = "land blind"
SILENT: Final = "silent"
REACTIONS: Final = {
    REFUSE: "does not take off",
    SLOW: "flies no faster than `limits.blind_speed`",
    HOLD: "leaves the formation and keeps its place",
    LAND: "lands",
    BLIND: "flies by no pose: stops, or descends straight down where it lands or is beneath another drone",
    SILENT: "commands nothing: a driver without commands lands its drone",
}
INPUTS: Final = {
    "end": "time since its process was told to end, s",
    "left out": "1 if the order in force leaves it out",
    "law": "1 while its law has failed, or its neighbours disagree about the leader",
    "held up": "1 while it is off the ground with stopped motors",
    "own pose": "its age, s",
    "own pose lost": "the same, but at most the time since its process began",
    "leader estimate": "the age of the leader's newest data; for a law without estimates of anything of a neighbour, s",
    "leader down": "time for which the leader of the ordered formation does not lead, s",
    "neighbour": "the number of neighbours that are not heard or seen",
    "nearby": "the age of the nearby bodies, s",
    "telemetry": "its age, s",
    "battery": "share of full",
    "fence": "distance outside `limits.fence`, m",
    "set down": "1 while its driver lands it",
    "pause": "time since its last step, s",
    "woke": "time since the last pause of more than 0.25 s, s",
    "no order": "time without any order since its process began, s",
    "standing": "time that it had poses on the ground in this landing, s, while it has one",
    "standing telemetry": "the age of telemetry, s, while its pose is on the ground",
}
SHUTDOWN: Final = "its process must end"
LEFT_OUT: Final = "left out of this flight"
HELD_UP: Final = "off the ground with stopped motors: put it down on a floor that its sensor detects"
ESTIMATE: Final = "leader estimate"  # what may be missing
NEIGHBOURS: Final = "sight or message of a neighbour"
WITHOUT_ORDER: Final = "in flight without an order: no station repeats one"
EVERY: Final = frozenset(PILOT_PHASES)
GROUND: Final = frozenset({Phase.GROUNDED, Phase.READY})
TAKEOFF: Final = frozenset({Phase.TAKEOFF})
LANDING: Final = frozenset({Phase.LANDING})


@dataclass(frozen=True, slots=True)
class Row(Frozen):
    """One row: `reaction`, in any of `phases`, while `input` is above `limit` (`below`: below it).

    `limit` is a number, or the name of one in [limits]. `text` is the reason in the status: `{value}` is that of the
    input, `{limit}` the limit's, `{failure}`, `{missing}`, `{news}` and `{driver}` are those of Reactions.
    """

    reaction: str
    input: str
    limit: float | str
    text: str = ""
    phases: frozenset[Phase] = EVERY
    below: bool = False

    @property
    def code(self) -> str:
        """The code of the reason in the status."""
        return f"{self.input}: {self.reaction}"


TABLE: Final = (
    Row(REFUSE, "end", 0.0, SHUTDOWN),
    Row(REFUSE, "left out", 0.0, LEFT_OUT),
    Row(REFUSE, "law", 0.0, "{failure}"),
    Row(REFUSE, "held up", 0.0, HELD_UP),
    Row(REFUSE, "own pose", "staleness.pose_zero", "waits for its own pose"),
    Row(REFUSE, "telemetry", "staleness.telemetry_warn", "waits for telemetry from {driver}"),
    Row(REFUSE, "neighbour", 0.0, "waits for {missing}"),
    Row(REFUSE, "nearby", "staleness.nearby_slow", "waits for its nearby bodies"),
    Row(REFUSE, "battery", "battery_takeoff", "battery at {value:.0%}, take-off needs {limit:.0%}", below=True),
    Row(REFUSE, "woke", 0.2, "was frozen, reads what waits for it", below=True),  # a landing may be behind a take-off
    Row(SLOW, "nearby", "staleness.nearby_slow"),
    Row(HOLD, "end", 0.0, SHUTDOWN),
    Row(HOLD, "law", 0.0, "{failure}"),
    Row(HOLD, "own pose", "staleness.pose_zero", "own pose is stale"),
    Row(HOLD, "leader estimate", "staleness.estimates_hold", "no {news} for {limit:g} s"),
    Row(HOLD, "leader down", 0.0, "the leader is down"),
    Row(HOLD, "nearby", "staleness.nearby_hold", "nearby bodies are stale"),
    Row(LAND, "own pose lost", "staleness.pose_land", "own pose lost for {value:.1f} s"),
    Row(LAND, "leader estimate", "staleness.estimates_land", "{news} lost for {value:.1f} s"),
    Row(LAND, "telemetry", "staleness.telemetry_land", "telemetry lost for {value:.1f} s"),
    Row(LAND, "leader down", "staleness.leader_land", "the leader lost for {value:.1f} s"),
    Row(LAND, "battery", "battery_land", "battery at {value:.0%}", below=True),
    Row(LAND, "fence", "fence.margin", "{value:.1f} m outside the fence"),
    Row(LAND, "set down", 0.0, "its driver lands it"),
    Row(LAND, "pause", "staleness.command_land", "was frozen as it took off: its driver lands it", TAKEOFF),
    Row(LAND, "end", 1.0, SHUTDOWN),
    Row(LAND, "no order", 10.0, WITHOUT_ORDER),
    Row(BLIND, "own pose", "staleness.pose_zero"),
    Row(BLIND, "standing", 1.0, phases=LANDING),  # they may be another body's
    Row(BLIND, "standing telemetry", 0.3, phases=LANDING),  # it may be down, where any other command pushes it along
    Row(SILENT, "telemetry", "staleness.telemetry_land", phases=GROUND),  # it may have taken off
)


class Bound:
    """A row, the place of its input among INPUTS, and its limit: what is compared a hundred times a second."""

    def __init__(self, row: Row, limits: Limits) -> None:
        limit = row.limit
        self.row: Final = row
        self.place: Final = list(INPUTS).index(row.input)
        self.limit: Final = float(attrgetter(limit)(limits) if isinstance(limit, str) else limit)


class Reactions:
    """Applies the table with the `limits` of a drone; `driver` are the processes that drive it.

    What it has of its neighbours are estimates of the leader, if its law `relays` them.
    """

    def __init__(self, limits: Limits, driver: str, leaders: tuple[int, ...], relays: bool) -> None:
        self._bounds = [Bound(row, limits) for row in TABLE]
        self._driver, self._leaders, self._relays = driver, leaders, relays

    def find(
        self, values: list[float], phase: Phase, failure: str = "", missing: tuple[int, ...] = ()
    ) -> dict[str, Reason]:
        """Return the first reason for each reaction in `phase`; `values` are those of INPUTS, in their order.

        `failure` is that of the law; the neighbours `missing` have no valid estimate.
        """
        found: dict[str, Reason] = {}
        for bound in self._bounds:
            row, value, limit = bound.row, values[bound.place], bound.limit
            beyond = value < limit if row.below else value > limit
            if beyond and row.reaction not in found and phase in row.phases:
                names, news = ", ".join(map(self._name, missing)), ESTIMATE if self._relays else NEIGHBOURS
                text = row.text.format(
                    value=value, limit=limit, driver=self._driver, missing=names, failure=failure, news=news
                )
                found[row.reaction] = Reason(row.code, text)
        return found

    def _name(self, j: int) -> str:
        """Return what is missing of the neighbour j, in words."""
        if not self._relays:
            return uav(j)
        return "the leader's pose" if j in self._leaders else f"{uav(j)}'s estimate"

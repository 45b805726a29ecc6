"""What a follower's law sees and hears of others, and what it sends them."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from functools import partial
from math import inf
from typing import Any

from flockwire_core.domain.law_message import Signals
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.time import nanoseconds
from flockwire_core.law import Decision, Heard, Information, Seen
from flockwire_core.pilot.neighbourhood import Neighbourhood
from flockwire_core.pilot.senses import Hearing, LawSender, Presence, Sight
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.information import relays, sees, signs, speakers
from flockwire_core.wire.keys import LEADS, Key
from flockwire_core.wire.law_form import LawForm
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import SILENT, Reason, Report, counted


class Exchange:
    """The ways by which follower `number` knows of others, as its law of the information `declared` may.

    `silence` is the time, s, for which nobody was noticed, `missing` are the in-neighbours that are not.
    """

    def __init__(self, swarm: Swarm, number: int, declared: Information, form: LawForm | None, born: int) -> None:
        neighbours, leaders = swarm.topology.neighbours(number), frozenset(swarm.leaders)
        self.silence, self.missing, self.leader_down = 0.0, tuple[int, ...](), False
        self.heard: list[Heard] = []
        self.news: list[Heard] = []
        self._estimate_key, self._law_key = Key("estimate", uav(number)), Key("law", uav(number))
        self._born, self._frame, self._relays = born, swarm.frame, relays(swarm)
        self.neighbours: Sequence[Seen] = ()
        self.around: Sequence[Seen] = ()
        self.neighbourhood = _neighbourhood(swarm, number)
        self._sign_limit = nanoseconds(swarm.limits.staleness.leader_silent)
        self._signs = dict.fromkeys(signs(swarm), 0)  # when each leader gave its last one, Unix ns; 0: never
        self.handlers: dict[Key, Callable[[Any], None]] = {
            **{Key("pose", uav(j)): self.neighbourhood.take_pose(j) for j in neighbours},
            **{Key("estimate", uav(j)): self.neighbourhood.take_estimate(j) for j in neighbours},
            **{Key(LEADS, uav(j)): partial(self._take_sign, j) for j in self._signs},
        }
        self._noticed: list[Presence] = []
        self._sight = self._hearing = self._sender = None
        if sees(swarm):
            self._sight = Sight(neighbours if declared.neighbours else {}, leaders, declared.silence)
            self._noticed.append(self._sight)
            self.handlers[Key("seen", uav(number))] = self._sight.take
        if form is not None:
            heard = {j: weight for j, weight in neighbours.items() if j in speakers(swarm)}
            self._hearing = Hearing(heard, leaders, form, declared.pace, declared.silence)
            self._noticed.append(self._hearing)
            self._sender = LawSender(form, declared.pace, swarm.frame, born)
            self.handlers |= {Key("law", uav(j)): self._hearing.take(j) for j in heard}

    def leave_out(self, drones: Container[int]) -> None:
        """Ignore `drones` until called again."""
        self.neighbourhood.leave_out(drones)
        for part in self._noticed:
            part.leave_out(drones)

    def update(self, now: int) -> None:
        """Update what is known at `now` (Unix ns)."""
        neighbourhood, born = self.neighbourhood, self._born
        self.silence, self.missing = 0.0, ()
        if self._relays:
            self.heard = neighbourhood.update(now)
            self.silence, self.missing = neighbourhood.silence(now, born), neighbourhood.missing
        for part in self._noticed:
            part.update(now)
            self.silence = max(self.silence, part.silence(now, born))
            self.missing = tuple(dict.fromkeys((*self.missing, *part.missing))) if part.missing else self.missing
        if self._sight is not None:
            self.neighbours, self.around = self._sight.neighbours, self._sight.around
        if self._hearing is not None:
            self.heard, self.news = self._hearing.heard, self._hearing.news
        self.leader_down = neighbourhood.leading is Leading.IS_DOWN
        if self._signs and self._has_silent_leader(now):
            self.leader_down = True

    def _take_sign(self, j: int, sign: Signals) -> None:
        self._signs[j] = sign.stamp

    def _has_silent_leader(self, now: int) -> bool:
        """Return whether a leader that led gives no sign at `now` (Unix ns): one of several stops the formation."""
        oldest = now - self._sign_limit
        return any(0 < stamp < oldest for stamp in self._signs.values())

    def estimate(self, decision: Decision) -> LeaderMotion | None:
        """Return the estimate of the leader that a law's decision has, of a law that relays it."""
        return decision.message if self._relays else None

    def messages(self, decision: Decision, message: bytes | None, failed: bool, now: int) -> list[tuple[Key, Message]]:
        """Return what to publish at `now` (Unix ns): the law's packed `message`, or its estimate; none that failed."""
        found: list[tuple[Key, Message]] = []
        if self._sender is not None and not failed:  # a failed law gives no sign of life
            sent = self._sender.send(message, now, decision.stamp)
            if sent is not None:
                found.append((self._law_key, sent))
        estimate = self.estimate(decision)
        if estimate is not None:
            origin, hops, leading = self.neighbourhood.origin, self.neighbourhood.hops, self.neighbourhood.leading
            own = Estimate(decision.stamp or now, self._frame, estimate, origin, hops, leading)
            found.append((self._estimate_key, own))
        return found

    def contradiction(self, now: int) -> str:
        """Return in what the neighbours' estimates contradict each other at `now` (Unix ns), empty if they agree."""
        agreement = self.neighbourhood.agreement
        return agreement.reason(now) if agreement.contradicted else ""

    def oldest(self, now: int) -> float:
        """Return the largest time, s, since an in-neighbour was noticed; NEVER if one never was."""
        oldest = self.neighbourhood.oldest(now) if self._relays else 0.0
        return max([oldest, *(part.oldest(now) for part in self._noticed)])

    def reported(self, report: Report) -> Report:
        """Return `report` with whom it misses in formation, and how many messages of the law were lost or rejected."""
        if self.missing and not self._relays and report.phase == Phase.FORMATION:
            silent = Reason(SILENT, f"nothing from {', '.join(map(uav, self.missing))}")
            report = report._replace(reasons=(*report.reasons, silent))
        if self._hearing is None:
            return report
        speakers = self._hearing.speakers.values()
        counts = counted(
            ("law messages lost", sum([one.lost for one in speakers])),
            ("law messages rejected", sum([one.rejected for one in speakers])),
        )
        return report._replace(counts=(*report.counts, *counts))

    def agreed(self, report: Report, now: int) -> Report:
        """Return `report` with whose estimates were left out."""
        agreement = self.neighbourhood.agreement
        if not agreement.count:
            return report
        counts = (*report.counts, ("estimates left out", agreement.count))
        return report._replace(reasons=(*report.reasons, *agreement.reasons(now)), counts=counts)


def _neighbourhood(swarm: Swarm, number: int) -> Neighbourhood:
    neighbours, depths, filtered = swarm.topology.neighbours(number), swarm.topology.depths(), swarm.control.filtered
    return Neighbourhood(
        neighbours,
        swarm.limits.staleness,
        swarm.reference.kind,
        swarm.limits.disagreement if filtered else inf,
        frozenset(j for j in neighbours if filtered and depths.get(j, 0) < depths.get(number, 0)),
        swarm.limits.speed,
        swarm.sole_leader,
    )

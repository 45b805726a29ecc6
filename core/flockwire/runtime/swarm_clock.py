"""Swarm time for a process that runs no core: it corrects its clock as the shell does for all others."""

from __future__ import annotations

from flockwire import clock
from flockwire.flight.timekeeping import Timekeeping, timekeeping
from flockwire.runtime.session import Session
from flockwire.runtime.subscriptions import Prompt, Wakeup
from flockwire.wire.plan import Plan


class SwarmClock:
    """Corrects this process's clock, in the running loop; on the gateway's host there is nothing to do."""

    def __init__(self, plan: Plan, identity: str, session: Session) -> None:
        self.timekeeping: Timekeeping = timekeeping(plan, identity, clock.correct)
        self._session, self._subscribed = session, False

    def step(self) -> None:
        """Ask again when it is time: to be called ten times a second or more."""
        if not self._subscribed:
            self._subscribed = True
            self._subscribe()
        if outgoing := self.timekeeping.step(clock.now()):
            self._session.publish(outgoing)

    def _subscribe(self) -> None:
        if self.timekeeping.keys:
            wakeup = Wakeup(self._arrived)
            for key in self.timekeeping.keys:
                self._session.prompt(key, wakeup)

    def known(self) -> bool:
        """Return whether swarm time is known here."""
        return self.timekeeping.figures(clock.now())[1] >= 0.0

    def _arrived(self, prompt: Prompt) -> None:
        now = clock.now()
        message = prompt.message(now)
        if message is not None:
            self._session.publish(self.timekeeping.receive(prompt.inbox.key, message, now))

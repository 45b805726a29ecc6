"""Keeps one Tello in SDK mode, identifies it, and reports problems of the link with a remedy."""

from __future__ import annotations

from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Address
from flockwire_core.wire.status import SERIAL, Reason

from flockwire_tello.client import CommandOutcome, Finished, TelloClient
from flockwire_tello.flight_monitor import FlightMonitor

LINK, FIRMWARE = "link", "firmware"  # codes of reasons
ENTER = "command"
QUESTIONS = ("sdk?", "sn?")


class TelloLink:
    """The link to the Tello at `drone`, whose state comes to `state_port`. Times are ns of one steady clock."""

    def __init__(self, client: TelloClient, monitor: FlightMonitor, drone: Address, state_port: int) -> None:
        self.sdk = self.serial = ""
        self._client, self._monitor, self._drone, self._state_port = client, monitor, drone, state_port
        self._begun: int | None = None
        self._entering, self._again_at = False, 0
        self._replied = False  # to the newest `command`
        self._refusal = ""
        self._had_state = False
        self._reentries = 0

    def step(self, now: int) -> None:
        """Enter SDK mode, and again if the state stops: a drone that was switched off has left it."""
        self._begun = now if self._begun is None else self._begun
        heard = self._monitor.heard(now)
        self._had_state = self._had_state or heard
        if not heard and not self._entering and now >= self._again_at:
            self._entering = True
            self._client.send(ENTER, now)

    def ended(self, done: Finished, now: int) -> None:
        """Record a command that ended."""
        good = done.outcome is CommandOutcome.DONE
        if done.command == ENTER:
            self._entered(done, good, now)
        elif done.command == "sdk?":
            self.sdk = done.reply if good else "1.3" if done.outcome is CommandOutcome.REFUSED else ""
        elif done.command == "sn?" and good:
            self.serial = done.reply

    def _entered(self, done: Finished, good: bool, now: int) -> None:
        # ns between two `command`: the state needs time to arrive
        self._entering, self._replied, self._again_at = False, good, now + SECOND // 2
        self._refusal = done.reply if done.outcome is CommandOutcome.REFUSED else ""
        if good:
            self._reentries += self._had_state
            for question in () if self.sdk else QUESTIONS:
                self._client.send(question, now)

    def trouble(self, now: int) -> Reason | None:
        """Return the problem; None without one, or if it is too early to know."""
        if self._refusal:
            return Reason(LINK, f"{self._where} refuses SDK mode ({self._refusal})", "switch the drone off and on")
        if self._monitor.heard(now):
            taken = Reason(LINK, "its state comes and goes", "another client commands it too: end that client")
            # interruptions of the state despite replies before another client is suspected
            return taken if self._reentries > 2 else None
        if self._had_state:
            return Reason(LINK, f"silent for {self._monitor.silence(now) / SECOND:.1f} s", "battery, or out of range")
        return self._never_heard() if now - (self._begun or now) >= 3 * SECOND // 2 else None  # ns

    def _never_heard(self) -> Reason:
        """Return why no state has ever arrived."""
        if self._client.malformed_states:
            form = "its state has a form that no SDK has (1.3, 2.0, 3.0)"
            return Reason(FIRMWARE, form, "update its firmware, or it is not a Tello")
        if self._replied:
            return Reason(
                LINK,
                f"it replies, but its state does not come to port {self._state_port}",
                "let UDP through the firewall, end any other client, or switch tello.source_filter off behind an "
                "address translation",
            )
        return Reason(LINK, f"no reply from {self._where}", "switch it on and join its network")

    @property
    def _where(self) -> str:
        return f"{self._drone[0]}:{self._drone[1]}"

    @property
    def named(self) -> tuple[Reason, ...]:
        """The drone's SDK and serial number, if known."""
        sdk = (Reason(FIRMWARE, f"SDK {self.sdk}"),) if self.sdk else ()
        return (*sdk, Reason(SERIAL, self.serial)) if self.serial else sdk

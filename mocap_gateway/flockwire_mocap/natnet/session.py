"""The state of a NatNet client, without sockets: datagrams and time in, frames and requests out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.gateway import NatNet

from flockwire_mocap.natnet.packets import (
    MODELS_CHANGED,
    Kind,
    MocapFrame,
    ModelDefinition,
    Packet,
    Rejected,
    Response,
    ServerInfo,
    Version,
    can_adjust,
    encode,
    encode_command,
    encode_connect,
    encode_model_request,
    version_of,
)
from flockwire_mocap.natnet.parsing import parse
from flockwire_mocap.streamed import MISSING, RESTARTS, FrameSequence
from flockwire_mocap.tracking import ReportedBody, TrackerFrame, is_pose

PERIOD = SECOND  # ns between two keep-alives, and between two attempts at anything else
SILENCE = 3 * SECOND  # ns without a packet after which the greeting is repeated
MODEL_PAUSE = 4 * SECOND  # ns more between two model definitions; some servers mark every frame as changed


@dataclass(slots=True)
class _Request:
    """A request that is repeated until it is answered: its next time (ns), and its count."""

    due: int = 0
    made: int = 0
    wanted: bool = True

    def make(self, now: int) -> bool:
        """Return whether it is due now, and count it."""
        if not self.wanted or now < self.due:
            return False
        self.due, self.made = now + PERIOD, self.made + 1
        return True


class NatNetSession:
    """The state of the server of `table`, from its packets; `bodies` are the names that it should have.

    Names are requested again when the server or its stream has restarted, and until then no body has one: the numbers
    may be others. They are also requested again, with a pause, when the server marks a change, when a frame that may
    have had that mark is lost, when a number has no name, and while one of `bodies` is missing.

    Attributes:
        info: the server's answer to the greeting, None before it.
        names: of rigid bodies by number, once a model definition has come.
        frames: how many were passed on; `empty`: how many of them were without a rigid body.
        framed_at: when the newest came, ns; `answered_at`: when the newest answer to a greeting came.
        counts: of bad frames and packets: missing or late, unreadable, from other addresses than the server's; and of
            poses marked as tracked that are invalid: not finite, or not a unit quaternion.
        foreign: the newest other address that sent a packet.
        rejected: reason of the newest packet if it was malformed.
        failure: why the sockets do not receive, None if they do.

    """

    def __init__(self, table: NatNet, bodies: Iterable[str] = ()) -> None:
        self.table = table
        self._asked = version_of(table.bitstream) if table.bitstream is not None else None
        self._bodies = frozenset(bodies)
        self.info: ServerInfo | None = None
        self.names: dict[int, str] = {}
        self.frames = self.empty = 0
        self.counts: Counter[str] = Counter()
        self._sequence = FrameSequence(self.counts)
        self.foreign: str | None = None
        self.rejected: str | None = None
        self.failure: str | None = None
        self.adjusted = False  # whether the server has agreed to the bitstream of the table
        self._received_at = self.framed_at = self.answered_at = 0
        self._greeting, self._keep_alive, self._bitstream = _Request(), _Request(), _Request()
        self._model = _Request(wanted=table.request_model)

    @property
    def version(self) -> Version | None:
        """The version that the stream is read in, if it is known."""
        if self._asked is not None and (self.table.multicast or self.adjusted):
            return self._asked
        return self.info.version if self.info is not None else None

    def requests(self, now: int) -> list[bytes]:
        """Return the datagrams to be sent to the server's command port at `now`, ns; call it every 0.1 s or so."""
        due: list[bytes] = []
        if (self.info is None or now - self._received_at > SILENCE) and self._greeting.make(now):
            due.append(encode_connect())
        if self.info is not None:
            due += self._requests_of_stream(self.info, now)
        return due

    def _requests_of_stream(self, info: ServerInfo, now: int) -> list[bytes]:
        due: list[bytes] = []
        if not self.table.multicast and self._keep_alive.make(now):
            due.append(encode(Kind.KEEP_ALIVE))
        asked = self._asked
        adjustable = can_adjust(info.version, self.table.multicast)
        if asked is not None and not self.adjusted and adjustable and self._bitstream.make(now):
            due.append(encode_command("Bitstream,{}.{}".format(*asked)))
        # requests are limited: a server that does not answer may stop streaming
        if self._model.made < 3 and self._model.make(now):
            due.append(encode_model_request(masked=self._model.made % 2 == 0))
        return due

    def receive(self, datagram: bytes, source: str, now: int) -> TrackerFrame | None:
        """Receive a datagram that came from the address `source` at `now`, ns; returns a frame newer than all before.

        Any port is accepted: unicast frames arrive at the command socket, from either port of the server.
        """
        if source != self.table.server:
            self.counts["packets of others"] += 1
            self.foreign = source
            return None
        if now - self._received_at > SILENCE:
            self._forget_names()
        self._received_at = now
        return self._take_in(parse(datagram, self.version), now)

    def answers(self, now: int) -> bool:
        """Return whether the server has answered a greeting lately, and streamed nothing since."""
        # ns for which an answer to the greeting shows that the server is there
        return self.answered_at >= self.framed_at and now - self.answered_at <= SILENCE + 2 * PERIOD

    def silent(self, now: int) -> bool:
        """Return whether nothing has come from the server lately, though it was greeted again."""
        return now - self._received_at > SILENCE + PERIOD

    def _take_in(self, packet: Packet, now: int) -> TrackerFrame | None:
        match packet:
            case MocapFrame():
                self.rejected = None
                return self._frame(packet, now)
            case ServerInfo():
                if packet != self.info:
                    self._forget_names()
                self.info, self.adjusted, self.answered_at = packet, False, now
            case ModelDefinition():
                self._model.wanted = not packet.complete
                self.names = packet.names
            case Response() if self._asked is not None:
                confirmed = "Bitstream,{}.{}".format(*self._asked)
                self.adjusted |= packet.code == 0 or (packet.text or "").replace(" ", "").startswith(confirmed)
            case Rejected():
                self.counts["packets malformed"] += 1
                self.rejected = packet.reason
        return None

    def _forget_names(self) -> None:
        self.names = {}
        self._model = _Request(due=self._model.due, wanted=self.table.request_model)

    def _frame(self, frame: MocapFrame, now: int) -> TrackerFrame | None:
        missing, restarts = self.counts[MISSING], self.counts[RESTARTS]
        if not self._sequence.arrived(frame.number):
            return None
        self.frames += 1
        self.framed_at = now
        self.empty += not frame.bodies
        if self.counts[RESTARTS] > restarts:
            self._forget_names()
        elif self.table.request_model and not self._model.wanted:
            again = self._model.due + MODEL_PAUSE
            changed = frame.parameters & MODELS_CHANGED or self.counts[MISSING] > missing
            if changed or (now >= again and self._lacks_names(frame)):
                self._model = _Request(due=again)
        captured, transmitted = self._times(frame)
        return TrackerFrame(frame.number, captured, transmitted, tuple(map(self._body, frame.bodies)))

    def _lacks_names(self, frame: MocapFrame) -> bool:
        known = self.names
        return any(body.identity not in known for body in frame.bodies) or not self._bodies.issubset(known.values())

    def _body(self, body: ReportedBody) -> ReportedBody:
        """Return `body` with its name, untracked if its pose is none."""
        tracked = body.tracked
        if tracked and not is_pose(body.position, body.orientation):
            self.counts["poses rejected"] += 1
            tracked = False
        return ReportedBody(body.identity, self.names.get(body.identity), body.position, body.orientation, tracked)

    def _times(self, frame: MocapFrame) -> tuple[int, int]:
        """Return when the frame was captured and sent, ns of one clock: the ticks, or the time stamp without them."""
        frequency = self.info.clock_frequency if self.info is not None else 0
        if not frequency or not frame.transmitted:
            seconds = frame.timestamp
            stamp = nanoseconds(seconds) if abs(seconds) < SECOND else 0  # NaN and nonsense fail
            return stamp, stamp
        transmitted = frame.transmitted * SECOND // frequency
        known = 0 < frame.mid_exposure <= frame.transmitted
        return (frame.mid_exposure * SECOND // frequency if known else transmitted), transmitted

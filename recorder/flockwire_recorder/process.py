"""The process of the recorder: everything that is said in the swarm goes into one trace, bytes untouched."""

from __future__ import annotations

import logging
from collections import Counter
from operator import itemgetter
from pathlib import Path

from flockwire import clock, policy
from flockwire.cdr import MessageError
from flockwire.config import Swarm
from flockwire.inbox import CANARY, read_attachment
from flockwire.keys import ROWS, key_text
from flockwire.refusals import Refusals
from flockwire.runtime import Deadlines, ending, make_teller
from flockwire.schemas import ROS_TYPES
from flockwire.session import Session, connect
from flockwire.status import Report
from flockwire.ticker import Ticker

from flockwire_recorder.trace import TraceFullError, TraceWriter, describe

IDENTITY = "recorder"
DRAIN_PERIOD = 0.02  # s
FLUSH_EVERY = 5  # drains: at most a tenth of a second is lost with the process
CAPACITY = 2048  # samples of one key that wait between two drains

Row = tuple[int, str, str, bytes, int, bytes]  # source time, topic, type, publisher, sequence, payload


class Recorder:
    """Drains all keys into a trace."""

    def __init__(self, swarm: Swarm, session: Session, trace: TraceWriter, refusals: Refusals) -> None:
        self._trace = trace
        self._teller = make_teller(swarm, IDENTITY, session, refusals)
        self._deadlines = Deadlines()
        self._rejected: Counter[str] = Counter()
        self._full = ""
        self._sources = [
            (key_text(swarm, key), ROS_TYPES[ROWS[key.kind].message], session.every(key, CAPACITY))
            for key in policy.hears(swarm, IDENTITY)
        ]

    def tick(self, lateness: int, skipped: int) -> None:
        """Take what has come since the last tick."""
        self._deadlines.count(lateness, skipped)
        now = clock.now()
        try:
            self.drain(now)
            if self._deadlines.steps % FLUSH_EVERY == 0:
                self._trace.flush()
        except TraceFullError as error:
            self._full = str(error)
            logging.getLogger(IDENTITY).error(self._full)
        if now >= self._teller.due:
            self._teller.tell(now, self._report(), self._deadlines, tuple(self._rejected.items()))

    def drain(self, now: int) -> None:
        """Write everything that waits, in the order in which it was sent. Raises TraceFullError once."""
        rows: list[Row] = []
        for topic, ros_type, subscriber in self._sources:
            while (sample := subscriber.try_recv()) is not None:
                attached, payload = sample.attachment, sample.payload.to_bytes()
                if payload.startswith(CANARY):
                    self._rejected[f"{topic} canary"] += 1
                    continue
                try:
                    origin = read_attachment(attached.to_bytes() if attached is not None else b"")
                except MessageError:
                    self._rejected[f"{topic} malformed"] += 1
                    continue
                rows.append((origin.sent, topic, ros_type, origin.publisher, origin.sequence, payload))
        rows.sort(key=itemgetter(0))
        for sent, topic, ros_type, publisher, sequence, payload in rows:
            self._trace.write(f"/{topic}", ros_type, publisher, sequence, now, sent, payload)

    def _report(self) -> Report:
        if self._full:
            return Report("full", f"{self._full}; {self._trace.dropped} messages not recorded")
        return Report("recording") if self._trace.written > 1 else Report("waiting", "waits for messages")


async def run(swarm: Swarm, toml: str, out: Path, keys: Path | None) -> None:
    """Record into `out`/trace.mcap until the process is told to end."""
    ended, refusals = ending(), Refusals(IDENTITY)
    refusals.watch()
    session = await connect(swarm, IDENTITY, keys, ended)
    if session is None:
        return
    out.mkdir(parents=True, exist_ok=True)
    trace = TraceWriter(out / "trace.mcap", describe(swarm, toml, swarm.gateway.seed, clock.now()))
    with session:
        recorder = Recorder(swarm, session, trace, refusals)
        ticker = Ticker(DRAIN_PERIOD, recorder.tick)
        ticker.start()
        try:
            await ended.wait()
        finally:
            ticker.stop()
            try:
                recorder.drain(clock.now())
                trace.close()
            except TraceFullError as error:
                logging.getLogger(IDENTITY).error(str(error))

"""The process of the recorder: everything that is said in the swarm goes into one trace, bytes untouched."""

from __future__ import annotations

import logging
from collections import Counter
from operator import itemgetter

from flockwire import clock
from flockwire.flight.stepping import Deadlines
from flockwire.runtime.detours import read_detours
from flockwire.runtime.ending import Ending, finished, last_resort
from flockwire.runtime.job import Job
from flockwire.runtime.refusals import Refusals
from flockwire.runtime.session import Session, connect
from flockwire.runtime.shell import status_publisher
from flockwire.runtime.ticker import Ticker
from flockwire.wire.cdr import MessageError
from flockwire.wire.inbox import CANARY, read_attachment
from flockwire.wire.keys import ROWS
from flockwire.wire.plan import Plan
from flockwire.wire.schemas import ROS_TYPES
from flockwire.wire.status import Report

from flockwire_recorder.core import PERIOD, RecorderCore
from flockwire_recorder.trace import TraceFullError, TraceWriter, describe

FLUSH_EVERY = 5  # drains: at most a tenth of a second is lost with the process
CAPACITY = 2048  # samples of one key that are buffered between two drains

Entry = tuple[int, str, str, bytes, int, bytes]  # source time, topic, type, publisher, sequence, payload


class Recorder:
    """Drains all keys into a trace."""

    def __init__(self, plan: Plan, identity: str, session: Session, trace: TraceWriter, refusals: Refusals) -> None:
        self._trace, self._log = trace, logging.getLogger(identity)
        self._status = status_publisher(plan, identity, session, refusals)
        self._deadlines = Deadlines()
        self._rejected: Counter[str] = Counter()
        self._full = ""
        self._sources = [
            (plan.text(key), ROS_TYPES[ROWS[key.kind].message], session.every(key, CAPACITY))
            for key in plan.subscribes[identity]
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
            self._log.error(self._full)
        if now >= self._status.deadline:
            self._status.update(now, self._report(), self._deadlines, tuple(self._rejected.items()))

    def drain(self, now: int) -> None:
        """Write everything that is buffered, in the order in which it was sent. Raises TraceFullError once."""
        rows: list[Entry] = []
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


async def run(job: Job) -> None:
    """Record into `job.out`/trace.mcap until the process is told to end."""
    plan, identity = job.plan, job.identity
    ending, refusals = Ending(), Refusals(identity)
    refusals.watch()
    session = await connect(plan, identity, job.keys, ending.told, read_detours())
    if session is None:
        return
    job.out.mkdir(parents=True, exist_ok=True)
    seed = plan.swarm.gateway.seed
    trace = TraceWriter(job.out / "trace.mcap", describe(plan.swarm, job.toml, seed, clock.now()))
    with session:
        recorder = Recorder(plan, identity, session, trace, refusals)
        ticker = Ticker(PERIOD, recorder.tick)
        ticker.start()
        try:
            await finished(RecorderCore(), plan, identity, session, ending)
        finally:
            ticker.stop()
            last_resort()
            try:
                recorder.drain(clock.now())
                trace.close()
            except TraceFullError as error:
                logging.getLogger(identity).error(str(error))

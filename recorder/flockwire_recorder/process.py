"""The process of the recorder: everything that is published in the swarm goes into one trace, bytes untouched."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator
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
from flockwire.wire.inbox import BURST, CANARY, OVER_QUOTA, Quota, read_attachment
from flockwire.wire.keys import ROWS, Key
from flockwire.wire.plan import Plan
from flockwire.wire.schemas import ROS_TYPES
from flockwire.wire.status import FULL, Report

from flockwire_recorder.core import PERIOD, RecorderCore
from flockwire_recorder.parts import next_part
from flockwire_recorder.trace import TraceFullError, TraceWriter, describe

FLUSH_EVERY = 5  # drains: at most a tenth of a second is lost with the process
CAPACITY = 2048  # samples of one key that are buffered between two drains, at most

Entry = tuple[int, str, str, bytes, int, bytes]  # source time, topic, type, publisher, sequence, payload


class RecordedKey:
    """One key to record: its topic, its samples, and what exceeds its quota."""

    def __init__(self, plan: Plan, key: Key, session: Session) -> None:
        row = ROWS[key.kind]
        self.topic, self.ros_type = plan.text(key), ROS_TYPES[row.message]
        self._samples = session.every(key, min(CAPACITY, BURST * row.rate))
        self._quota, self._largest = Quota(row.rate), row.largest

    def entries(self, now: int, rejected: Counter[str]) -> Iterator[Entry]:
        """Yield what has come by `now` (Unix ns); count by key and reason what is not to be recorded."""
        while (sample := self._samples.try_recv()) is not None:
            if len(sample.payload) > self._largest or self._quota.exceeded(now):  # before anything is copied
                rejected[f"{self.topic} {OVER_QUOTA}"] += 1
                continue
            attached, payload = sample.attachment, sample.payload.to_bytes()
            if payload.startswith(CANARY):
                rejected[f"{self.topic} canary"] += 1
                continue
            try:
                origin = read_attachment(attached.to_bytes() if attached is not None else b"")
            except MessageError:
                rejected[f"{self.topic} malformed"] += 1
                continue
            yield origin.sent, self.topic, self.ros_type, origin.publisher, origin.sequence, payload


class Recorder:
    """Drains all keys into a trace. `full` is why the trace takes no more, None while it does."""

    def __init__(self, plan: Plan, identity: str, session: Session, trace: TraceWriter, refusals: Refusals) -> None:
        self._trace, self._log = trace, logging.getLogger(identity)
        self._status = status_publisher(plan, identity, session, refusals)
        self._deadlines = Deadlines()
        self._rejected: Counter[str] = Counter()
        self.full: TraceFullError | None = None
        self._sources = [RecordedKey(plan, key, session) for key in plan.subscribes[identity]]

    def tick(self, lateness: int, skipped: int) -> None:
        """Take what has come since the last tick."""
        self._deadlines.count(lateness, skipped)
        now = clock.now()
        try:
            self.drain(now)
            if self._deadlines.steps % FLUSH_EVERY == 0:
                self._trace.flush()
        except TraceFullError as error:
            self.full = error
            self._log.error(str(error))
        if now >= self._status.deadline:
            self._status.update(now, self._report(), self._deadlines, (*self._rejected.items(), *self._dropped()))

    def drain(self, now: int) -> None:
        """Write everything that is buffered, in the order in which it was sent. Raises TraceFullError once."""
        rows = [entry for source in self._sources for entry in source.entries(now, self._rejected)]
        rows.sort(key=itemgetter(0))
        for sent, topic, ros_type, publisher, sequence, payload in rows:
            self._trace.write(f"/{topic}", ros_type, publisher, sequence, now, sent, payload)

    def close(self) -> None:
        """Write what is left and close the trace. Raises TraceFullError where it took, or takes, no more."""
        self.drain(clock.now())
        self._trace.close()
        if self.full is not None:
            raise self.full

    def _dropped(self) -> tuple[tuple[str, int], ...]:
        return (("not recorded", self._trace.dropped),) if self._trace.dropped else ()

    def _report(self) -> Report:
        if self.full is not None:
            return Report(FULL, str(self.full.strerror))
        return Report("recording") if self._trace.written > 1 else Report("waiting", "waits for messages")


async def run(job: Job) -> None:
    """Record into the next part of the trace in `job.out` until the process is to end.

    Raises OSError where the trace cannot be written, or not to its end.
    """
    plan, identity = job.plan, job.identity
    ending, refusals = Ending(), Refusals(identity)
    refusals.watch()
    session = await connect(plan, identity, job.keys, ending.told, read_detours())
    if session is None:
        return
    with session:
        job.out.mkdir(parents=True, exist_ok=True)
        seed = plan.swarm.gateway.seed
        trace = TraceWriter(next_part(job.out), describe(plan.swarm, job.toml, seed, clock.now()))
        recorder = Recorder(plan, identity, session, trace, refusals)
        ticker = Ticker(PERIOD, recorder.tick)
        ticker.start()
        try:
            await finished(RecorderCore(), plan, identity, session, ending)
        finally:
            ticker.stop()
            last_resort()
        recorder.close()

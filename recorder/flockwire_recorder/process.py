"""The recorder's process: it writes all messages of the swarm, unchanged, into one trace."""

from __future__ import annotations

import logging
from collections import Counter

from flockwire_core import clock
from flockwire_core.process.cores import make_recorder
from flockwire_core.process.stepping import StepCounts
from flockwire_core.runtime.ending import Ending, last_resort, wait_for_end
from flockwire_core.runtime.job import Job, connect_job
from flockwire_core.runtime.refusals import Refusals
from flockwire_core.runtime.reporting import status_publisher
from flockwire_core.runtime.session import Session
from flockwire_core.runtime.swarm_clock import SwarmClock
from flockwire_core.runtime.ticker import Ticker
from flockwire_core.runtime.topics import BatchedTopics, Topic, in_order
from flockwire_core.trace_files import next_part
from flockwire_core.wire.keys import BATCH, ROWS, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.schemas import ROS_TYPES
from flockwire_core.wire.status import Report, counted

from flockwire_recorder.full import TraceFullError
from flockwire_recorder.trace import TraceWriter, describe, log_time_of, publication_time


class Recorder:
    """Drains all keys into a trace. `full` is why nothing more can be written, None otherwise."""

    def __init__(self, session: Session, trace: TraceWriter, refusals: Refusals) -> None:
        plan, identity = session.plan, session.identity
        self._trace, self._log = trace, logging.getLogger(identity)
        self._clock = SwarmClock(plan, identity, session)
        self._status = status_publisher(session, refusals, self._clock.timekeeping)
        self._counts = StepCounts()
        self._rejected: Counter[str] = Counter()
        self.full: TraceFullError | None = None
        keys = plan.subscribes[identity]
        self._topics = [(BatchedTopics if key.kind == BATCH else Topic)(plan, key, session) for key in keys]
        central = [one for one in plan.started if plan.rows[one].batches and plan.members[one].drone is None]
        self._central = {one: f"/{plan.text(Key('status', one))}" for one in central}  # no flight leaves them out
        self._ros_types = {f"/{plan.text(key)}": ROS_TYPES[ROWS[key.kind].message] for key in plan.keys}

    def tick(self, lateness: int, skipped: int) -> None:
        """Receive the messages since the last tick."""
        self._counts.count(lateness, skipped)
        self._clock.step()
        now = clock.now()
        try:
            self.drain(now)
            if self._counts.steps % 2 == 0:  # ticks: with what is in batches, at most 0.2 s is lost with the process
                self._trace.flush()
        except TraceFullError as error:
            self.full = error
            self._log.error(str(error))
        if self._status.due(now):
            dropped = counted(("not recorded", self._trace.dropped))
            self._status.update(now, self._report(), self._counts, (*self._rejected.items(), *dropped))

    def drain(self, now: int) -> None:
        """Write all buffered messages in the order of sending. Raises TraceFullError once."""
        for sent, topic, publisher, sequence, payload in in_order(self._topics, now, self._rejected):
            published = publication_time(sent, now)
            logged = log_time_of(published, now)
            self._trace.write(topic, self._ros_types[topic], publisher, sequence, logged, published, payload)

    def close(self) -> None:
        """Write the remaining messages and close the trace. Raises TraceFullError if the disk is or was full."""
        self.drain(clock.now())
        self._trace.close()
        if self.full is not None:
            raise self.full

    def _report(self) -> Report:
        if self.full is not None:
            return Report(Phase.FULL, str(self.full.strerror))
        unheard = [one for one, topic in self._central.items() if topic not in self._trace.topics]
        return Report(Phase.WAITING, f"does not hear {', '.join(unheard)}") if unheard else Report(Phase.RECORDING)


async def run(job: Job) -> None:
    """Record into the next part of the trace in `job.out` until the process is to end.

    Raises OSError if the trace cannot be written, or not to its end.
    """
    plan, identity = job.plan, job.identity
    ending, refusals = Ending(), Refusals(identity)
    refusals.watch()
    session = await connect_job(job, ending.ended)
    if session is None:
        return
    with session:
        job.out.mkdir(parents=True, exist_ok=True)
        seed = plan.swarm.gateway.seed
        trace = TraceWriter(next_part(job.out), describe(plan.swarm, job.toml, seed, clock.now(), job.notes))
        recorder, core = Recorder(session, trace, refusals), make_recorder()
        ticker = Ticker(core.period, recorder.tick)
        ticker.start()
        with last_resort(identity, ticker.stop):
            await wait_for_end(core, session, ending)
            recorder.close()  # before the last resort: a slow disk takes its time, who supervises ends what hangs

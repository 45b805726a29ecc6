"""The process in ROS 2: two sessions, one with the swarm's certificates and one in the ROS graph, and the core between.

Nothing is passed from one session to the other but what the core has decided.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging

from flockwire_core.domain.time import SECOND
from flockwire_core.process.stepping import StepCounts
from flockwire_core.ros.graph import advice
from flockwire_core.runtime.ending import Ending, last_resort, wait_for_end
from flockwire_core.runtime.job import Job, connect_job
from flockwire_core.runtime.refusals import Refusals
from flockwire_core.runtime.reporting import status_publisher
from flockwire_core.runtime.ros_ends import RosInput, RosOutput, RosServices
from flockwire_core.runtime.ros_node import Place, RosNode, join
from flockwire_core.runtime.session import Session, use_router_threads
from flockwire_core.runtime.ticker import Ticker
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.ros import Ros
from flockwire_core.wire.inbox import rejections
from flockwire_core.wire.status import counted

from flockwire_operator.ros.core import PERIOD, RosCore
from flockwire_operator.ros.mirror import Mirror, Outgoing
from flockwire_operator.ros.topics import Names, Topic, all_topics
from flockwire_operator.station.operator import Operator

SILENCE = SECOND  # ns without a message of the leader's topic, after which the status says why


class RosProcess:
    """Runs the core on `session`, and on a node in the ROS graph when there is one."""

    def __init__(self, session: Session, refusals: Refusals) -> None:
        self._plan, self._counts, identity = session.plan, StepCounts(), session.identity
        self._log = logging.getLogger(identity)
        self.core = RosCore(self._plan)
        self._operator = Operator(session, self.core.operator, self.core)
        self._status = status_publisher(session, refusals, self._operator.clock.timekeeping)
        self._node: RosNode | None = None
        self._outputs: dict[Topic, RosOutput] = {}
        self._outgoing = Outgoing()
        self._services: RosServices | None = None
        self._steering: RosInput | None = None
        self._steered = 0  # when the leader's topic was heard last, Unix ns

    def join(self, node: RosNode) -> None:
        """Publish on `node` from now on, and serve its requests."""
        self._outputs = {topic: node.publisher(*topic) for topic in all_topics(self._plan)}
        self._services = node.serve(tuple(self.core.services.orders))
        if self.core.steering is not None:
            topic = self.core.steering.topic
            self._steering = node.subscribe(topic.name, topic.ros_type)
            node.watch()
        self.core.mirror = Mirror(self._plan)
        self.core.dropped = lambda: counted(("not published", self._outgoing.dropped), *node.counts.items())
        self._node = node

    def joined(self, task: asyncio.Task[None]) -> None:
        """Report an error of the task that joins."""
        if not task.cancelled() and (error := task.exception()) is not None:
            self.core.trouble = f"cannot join the ROS graph: {error!r}"
            self._log.error(self.core.trouble, exc_info=error)

    def absent(self, why: str) -> None:
        """Record why there is no node."""
        self.core.trouble = f"{remedy(self._plan.swarm)} ({why})"

    def tick(self, lateness: int, skipped: int) -> None:
        """Take in what both sides have sent, step, and publish on both."""
        self._counts.count(lateness, skipped)
        now = self._operator.poll()
        self._take(now)
        self._operator.publish()
        if self.core.mirror is not None:
            self._outgoing.add(self.core.mirror.publications(now))
            for topic, payload in self._outgoing.take():
                self._outputs[topic].publish(payload)
        if self._status.due(now):
            self._report(now)

    def _take(self, now: int) -> None:
        if self._services is not None:
            for request in self._services.take():
                self.core.services.request(request.name, now, request.answer)
        if self._steering is not None and self.core.steering is not None:
            for arrived in self._steering.take():
                self._steered = now
                self.core.steering.take(arrived.payload, now)

    def _report(self, now: int) -> None:
        node, steering = self._node, self.core.steering
        if node is not None:
            self.core.trouble, self.core.advice = "" if node.linked else remedy(self._plan.swarm), ""
            if steering is not None and now - self._steered > SILENCE:
                name, kind = steering.topic.name, steering.topic.ros_type
                self.core.advice = advice(node.publishers(), node.place.domain, name, (kind,), "ros.domain to that")
        rejected = rejections((self._plan.text(source.inbox.key), source.inbox) for source in self._operator.inputs)
        self._status.update(now, self.core.report(now), self._counts, rejected)


def remedy(swarm: Swarm) -> str:
    """Return what to do if there is no router."""
    table = swarm.ros if swarm.ros is not None else Ros()
    if table.serve:
        return f"ros.router = {table.router!r}: cannot listen there; choose another port"
    return f"ros.router = {table.router!r}: no router answers; start rmw_zenohd there, or set ros.serve = true"


def place_of(swarm: Swarm, name: str) -> Place:
    """Return the place of a swarm's node `name` in the ROS graph."""
    table = swarm.ros if swarm.ros is not None else Ros()
    return Place(table.router, table.serve, table.domain, Names(swarm).namespace, name)


async def run(job: Job) -> None:
    """Show the swarm in ROS 2 until the process is to end."""
    plan, identity = job.plan, job.identity
    ending, refusals = Ending(), Refusals(identity)
    refusals.watch()
    place = place_of(plan.swarm, identity)
    if place.serves:
        use_router_threads()
    session = await connect_job(job, ending.ended)
    if session is None:
        return
    with contextlib.ExitStack() as stack:
        stack.enter_context(session)
        process = RosProcess(session, refusals)
        ticker = Ticker(PERIOD, process.tick)
        ticker.start()
        joining = asyncio.create_task(_join(process, place, ending, stack))
        joining.add_done_callback(process.joined)
        with last_resort(identity, ticker.stop):
            await wait_for_end(process.core, session, ending)
            await joining


async def _join(process: RosProcess, place: Place, ending: Ending, stack: contextlib.ExitStack) -> None:
    node = await join(place, ending.ended, process.absent)
    if node is not None:
        stack.enter_context(node)
        process.join(node)

"""CycloneDDS for lab/bench/transport.py: apart, since its types are declared when this is imported."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int64, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from flockwire_core.wire.inbox import ATTACHMENT

DOMAIN = 7
CONFIGURATION = """<CycloneDDS><Domain Id="any">
<General><Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
NEWEST = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(1), Policy.Deadline(duration(infinite=True)))


@dataclass
class Sent(IdlStruct, typename="Sent"):
    """What an estimate and its attachment are."""

    stamp: int64
    frame: str
    motion: array[float64, 9]
    origin: int64
    hops: int64
    attached: array[uint8, ATTACHMENT.size]


MOTION, ATTACHED = [0.0] * 9, [0] * ATTACHMENT.size


class _Answering(Listener):
    def __init__(self, receive: Callable[[int], int | None], send: Callable[[int], None]) -> None:
        super().__init__()
        self._receive, self._send = receive, send

    def on_data_available(self, reader: DataReader | None) -> None:
        for sample in reader.take(16) if reader is not None else ():  # None as the process ends
            if isinstance(sample, Sent) and (answer := self._receive(sample.stamp)) is not None:
                self._send(answer)


@contextlib.contextmanager
def opened(number: int, source: int | None, receive: Callable[[int], int | None]) -> Iterator[Callable[[int], None]]:
    """Open the end of process `number`, which receives what process `source` sends."""
    domain = Domain(DOMAIN, CONFIGURATION)
    participant = DomainParticipant(DOMAIN)
    writer = DataWriter(participant, Topic(participant, f"bench{number}", Sent, NEWEST), NEWEST)

    def send(stamp: int) -> None:
        writer.write(Sent(stamp, "world", MOTION, stamp, 0, ATTACHED))

    sources = [] if source is None else [Topic(participant, f"bench{source}", Sent, NEWEST)]
    readers = [DataReader(participant, topic, NEWEST, _Answering(receive, send)) for topic in sources]
    yield send
    del readers, domain  # nothing else holds them

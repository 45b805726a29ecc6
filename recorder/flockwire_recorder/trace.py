"""Writes the trace: every message of a swarm, unchanged, into one MCAP file.

Topics are the keys with a leading `/`, one channel for each, schemas are ROS 2 definitions: any ROS 2 tool reads the
file. The lower bits of a message's sequence number are its publisher's count, those above them the publisher's number
among those of the topic; metadata records give each one's id.
"""

from __future__ import annotations

import contextlib
import platform
from collections.abc import Collection, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path

from flockwire_core.control.auction import bids_of
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.inbox import BURST
from flockwire_core.wire.information import information_of
from flockwire_core.wire.law_form import LawForm, law_form
from flockwire_core.wire.schemas import schema_text

from flockwire_recorder.chunked import ChunkedWriter
from flockwire_recorder.full import TraceFullError

METADATA = "flockwire"
PUBLISHER = "publisher"  # name of a metadata record: topic, number and, in hexadecimal, id of one
PROFILE = "ros2"
OTHERS = b"others".ljust(16, b"\0")
COUNT_BITS = 26  # of the 32 bits of a sequence number: a week at 100 Hz
COUNT_MASK = (1 << COUNT_BITS) - 1


def describe(
    swarm: Swarm, toml: str, seed: int, started: int, notes: Mapping[str, str] | None = None, virtual: bool = False
) -> dict[str, str]:
    """Return the metadata of a trace; for a `virtual` flight it does not depend on the machine.

    `toml` is the swarm file's text, `seed` that of the run, `started` its Unix time in ns; `notes` are
    added.
    """
    form = LawForm(bids_of(len(swarm.followers))) if swarm.auctioned else law_form(information_of(swarm))
    law_fields = {"law_fields": form.definition} if form is not None else {}
    machine = {"zenoh": version("eclipse-zenoh"), "python": platform.python_version(), "host": platform.node()}
    return {
        "swarm": swarm.model_dump_json(),
        "toml": toml,
        "version": version("flockwire"),
        **({"world": "virtual"} if virtual else machine),
        "seed": str(seed),
        "started": datetime.fromtimestamp(started // SECOND, UTC).isoformat(),
        **law_fields,
        **(notes or {}),
    }


def about_publisher(topic: str, number: int, identity: str) -> dict[str, str]:
    """Return the metadata of the publisher of a topic that has this number in sequence numbers."""
    return {"topic": topic, "number": str(number), "id": identity}


class TraceWriter:
    """Writes messages to the MCAP file `path`; `metadata` is the result of `describe`.

    Data written before a `flush` survives the process, even kill -9, but not a power cut (there is no fsync). The first
    failure raises TraceFullError, from the constructor, `write`, `flush` or `close`. After it the file does not change,
    and `write` only counts in `dropped`. `recover` repairs such a file. The constructor raises OSError if the file
    cannot be opened.
    """

    def __init__(self, path: Path, metadata: dict[str, str]) -> None:
        self.written = 0
        self.dropped = 0
        self._path = path
        self._failed = False
        self._law_fields = metadata.get("law_fields", "")  # of the messages of its law
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._publishers: dict[str, dict[bytes, int]] = {}  # number of each, by topic
        self._stream = path.open("wb")
        self._writer = ChunkedWriter(self._stream, 256 * 1024)  # bytes after which a chunk ends without a flush
        try:
            self._writer.start(PROFILE, f"flockwire {version('flockwire')}")
            self._writer.add_metadata(METADATA, metadata)
            self._writer.flush()
        except OSError as error:
            raise self._failure(error) from error

    @property
    def topics(self) -> Collection[str]:
        """The topics with a message."""
        return self._channels.keys()

    def write(
        self,
        topic: str,
        ros_type: str,
        publisher: bytes,
        sequence: int,
        log_time: int,
        publish_time: int,
        payload: bytes,
    ) -> None:
        """Append one message.

        `publisher`, `sequence` and `publish_time` (Unix ns) come from the attachment, `log_time` is the result
        of `log_time_of` (Unix ns). Raises KeyError for a `ros_type` without a schema, TraceFullError once.
        """
        if self._failed:
            self.dropped += 1
            return
        channel = self._channels.get(topic)
        if channel is None:
            channel = self._channels[topic] = self._register(topic, ros_type)
        try:
            number = self._publishers[topic].get(publisher)
            if number is None:
                number = self._number(topic, publisher)
            count = number << COUNT_BITS | sequence & COUNT_MASK
            self._writer.add_message(channel, max(0, log_time), payload, max(0, publish_time), count)
        except OSError as error:
            self.dropped += 1
            raise self._failure(error) from error
        self.written += 1

    def flush(self) -> None:
        """End the chunk and pass all data to the operating system. Raises TraceFullError once."""
        if self._failed:
            return
        try:
            self._writer.flush()
        except OSError as error:
            raise self._failure(error) from error

    def close(self) -> None:
        """Write the summary section and close the file. Raises TraceFullError if that fails for the first time."""
        if self._stream.closed:
            return
        try:
            self._writer.finish()
            self._stream.close()
        except OSError as error:
            raise self._failure(error) from error

    def _register(self, topic: str, ros_type: str) -> int:
        schema = self._schemas.get(ros_type)
        if schema is None:
            schema = self._writer.register_schema(ros_type, "ros2msg", schema_text(ros_type, self._law_fields).encode())
            self._schemas[ros_type] = schema
        self._publishers[topic] = {}
        return self._writer.register_channel(topic, "cdr", schema, {})

    def _number(self, topic: str, publisher: bytes) -> int:
        """Return the number of a publisher that is new to its topic."""
        numbers = self._publishers[topic]
        if len(numbers) >= 63:  # publishers of one topic with their own number; all others share one
            publisher = OTHERS
        if publisher not in numbers:
            numbers[publisher] = len(numbers)
            self._writer.add_metadata(PUBLISHER, about_publisher(topic, numbers[publisher], publisher.hex()))
        return numbers[publisher]

    def _failure(self, error: OSError) -> TraceFullError:
        self._failed = True
        with contextlib.suppress(OSError):
            self._stream.close()
        return TraceFullError(error.errno, f"the trace takes no more: {error.strerror}", str(self._path))


WAITED = SECOND  # ns between publication and record, of a message that waited in a batch, at most


def publication_time(claimed: int, received: int) -> int:
    """Return when a message was published, Unix ns: `claimed` if it is near `received`, else `received`."""
    # ns between publication and record: a receiver that was frozen, a clock that is not known yet
    return claimed if abs(received - claimed) <= 10 * SECOND else received


def log_time_of(published: int, received: int) -> int:
    """Return the log time of a message, Unix ns: when it was `published`, as far as it may have waited for its batch.

    Whoever plays a trace goes by log times, and batches would all come at once.
    """
    return published if received - WAITED <= published <= received else received


def count_lost(sequences: Collection[int], rate: int, duration: int) -> int:
    """Return the number of missing messages within `duration` ns, from the recorded `sequences`.

    A gap counts only up to `rate` messages per s: a wider one is not a count of messages.
    """
    most, found = rate * (duration // SECOND + 1 + BURST), sorted(set(sequences))
    gaps = (later - earlier - 1 for earlier, later in pairwise(found))
    return min(most, sum(gap for gap in gaps if gap <= most))

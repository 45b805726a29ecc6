"""Batches of messages for the recorder."""

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.batch import FULL, LARGEST, PERIOD, Batch, BatchBuilder, Entry
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import decode, encode
from flockwire_core.wire.schemas import ROS_TYPES, schema_text
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

NOW = 1_790_000_000 * SECOND
ENTRIES = st.builds(
    Entry,
    st.text(max_size=30).filter(lambda text: "\0" not in text),
    st.integers(0, 2**63 - 1),
    st.integers(-(2**63), 2**63 - 1),
    st.binary(max_size=40),
)
BATCHES = st.builds(
    Batch, st.integers(0, (2**31 - 1) * SECOND), st.sampled_from(["", "w", "world"]), st.lists(ENTRIES).map(tuple)
)


@pytest.fixture(scope="module")
def ros():
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema_text(ROS_TYPES[Batch]), ROS_TYPES[Batch]))
    return store


@given(BATCHES)
def test_a_batch_comes_back(batch):
    assert decode(Batch, encode(batch)) == batch


@given(BATCHES)
def test_ros_reads_the_same_batch(ros, batch):
    message = ros.deserialize_cdr(encode(batch), ROS_TYPES[Batch])
    assert message.header.stamp.sec * SECOND + message.header.stamp.nanosec == batch.stamp
    assert message.header.frame_id == batch.frame
    read = [Entry(one.key, one.sequence, one.sent, bytes(one.payload)) for one in message.entries]
    assert tuple(read) == batch.entries


@given(BATCHES.filter(lambda batch: batch.entries), st.data())
def test_a_batch_that_is_cut_off_is_rejected(batch, data):
    whole = encode(batch)
    with pytest.raises(MessageError):
        decode(Batch, whole[: data.draw(st.integers(0, len(whole) - 1))])


@given(st.binary(max_size=200))
def test_junk_is_rejected_and_nothing_else_raised(junk):
    for data in (junk, b"\x00\x01\x00\x00" + junk, encode(Batch(NOW, "world", ()))[:-4] + junk):
        try:
            decode(Batch, data)
        except MessageError:
            continue


def test_a_batch_is_due_a_period_after_its_first_message_and_full_before_it_is_too_large():
    builder = BatchBuilder("world")
    assert not builder.is_due(NOW)
    assert not builder.add(Entry("uav1/pose", 0, NOW, b"x" * 100))
    assert not builder.is_due(NOW + PERIOD - 1)
    assert builder.is_due(NOW + PERIOD)
    assert builder.is_due(NOW - 1)  # swarm time was set back
    assert len(builder.take(NOW).entries) == 1
    assert not builder.is_due(NOW + PERIOD)
    added = 1
    while not builder.add(Entry("uav1/pose", added, NOW, b"x" * 1000)):
        added += 1
    assert FULL <= len(encode(builder.take(NOW))) + 1100 <= LARGEST

import signal

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.cdr import HEADER, LONGEST_SEQUENCE, MessageError, Reader, Writer
from hypothesis import given
from hypothesis import strategies as st

CODES = st.sampled_from("BIQd")


@given(st.lists(st.tuples(CODES, st.integers(0, 255))))
def test_what_the_writer_puts_the_reader_takes(values):
    writer = Writer()
    for code, value in values:
        writer.put_all(code, value)
    reader = Reader(writer.finish())
    assert [reader.take(code) for code, _ in values] == [value for _, value in values]
    reader.end()


@given(st.lists(st.text()), st.lists(st.integers(0, 2**64 - 1)))
def test_sequences_come_back(texts, numbers):
    writer = Writer()
    writer.texts(tuple(texts))
    writer.numbers("Q", tuple(numbers))
    reader = Reader(writer.finish())
    assert tuple([reader.text() for _ in range(reader.length())]) == tuple(texts)
    assert reader.numbers("Q") == tuple(numbers)
    reader.end()


@pytest.mark.parametrize("header", [b"", b"\0\1", b"\0\0\0\0", b"\0\2\0\0"])
def test_another_representation_is_refused(header):
    with pytest.raises(MessageError, match="header of little-endian CDR"):
        Reader(header)


def test_a_sequence_longer_than_any_is_refused_before_it_is_read():
    writer = Writer()
    writer.unsigned(LONGEST_SEQUENCE + 1)
    with pytest.raises(MessageError, match="the most is"):
        Reader(writer.finish()).length()


@pytest.mark.parametrize(
    ("raw", "rule"),
    [
        (b"\5\0\0\0abcd", "too soon"),
        (b"\4\0\0\0abcd", "does not end"),
        (b"\0\0\0\0", "does not end"),
        (b"\xff\xff\xff\xff", "too soon"),
        (b"\2\0\0\0\xff\0", "not UTF-8"),
        (b"\2\0", "too soon"),
    ],
)
def test_a_broken_string_is_refused(raw, rule):
    with pytest.raises(MessageError, match=rule):
        Reader(HEADER + raw).text()


@pytest.mark.parametrize(("rest", "sound"), [(b"", True), (b"\0\0\0", True), (b"\0\0\0\0", False), (b"\1", False)])
def test_only_padding_may_be_left_over(rest, sound):
    reader = Reader(HEADER + rest)
    if sound:
        reader.end()
    else:
        with pytest.raises(MessageError, match="left over"):
            reader.end()


@pytest.mark.parametrize(
    "stamp", [0, 1, 2**30 * SECOND - 1, 2**30 * SECOND, 1_790_000_000 * SECOND, 2**31 * SECOND - 1]
)
def test_an_interrupt_within_the_reading_of_a_time_is_an_exception(stamp):
    writer = Writer()
    writer.time(stamp)
    data, before = writer.finish(), signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        for _ in range(20):
            with pytest.raises(KeyboardInterrupt):
                signal.setitimer(signal.ITIMER_REAL, 0.0005)
                while True:
                    assert Reader(data).time() == stamp
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)

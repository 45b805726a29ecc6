import pytest
from flockwire_tello.commands import LONGEST, MOST, RULES, fits, refused, rule, split_replies
from hypothesis import given
from hypothesis import strategies as st

JUNK = bytes(range(0xCC, 0xE8)) + b"VQZd"


@pytest.mark.parametrize(
    ("datagram", "replies"),
    [
        (b"ok", ["ok"]),
        (b"87\r\n", ["87"]),
        (b"OK,drone will reboot in 3s\0", ["OK,drone will reboot in 3s"]),
        (b"ok\r\n87\r\n", ["ok", "87"]),
        (b"\xcc\x18\x01\xb9\x88ok", ["ok"]),
        (JUNK, ["VQZd"]),
        (b"\xff\xfe\x00\x80", []),
        (b"", []),
        (b"\r\n", []),
        (b"x" * (LONGEST + 1), []),
    ],
)
def test_replies_are_cut_out_of_a_datagram(datagram, replies):
    assert split_replies(datagram) == replies


@given(st.binary(max_size=LONGEST + 10))
def test_no_datagram_raises_and_what_is_left_is_bounded(datagram):
    replies = split_replies(datagram)
    assert len(replies) <= MOST
    assert sum(map(len, replies)) <= LONGEST
    for reply in replies:
        assert reply.isascii()
        assert reply.isprintable()
        for command in RULES:
            fits(command, reply)


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        ("takeoff", "ok"),
        ("takeoff", "error Motor stop"),
        ("go 10 10 10 20", "out of range"),
        ("ap a b", "OK,drone will reboot in 3s"),
        ("EXT mled g 00", "matrix ok"),
        ("EXT tof?", "tof 801"),
        ("battery?", "87"),
        ("time?", "12s"),
        ("time?", "12"),
        ("temp?", "62~65C"),
        ("sdk?", "20"),
        ("sn?", "0TQZH77ED00001"),
        ("sn?", "unknown command: sn?"),
        ("stop", "forced stop"),
        ("something new", "whatever"),
    ],
)
def test_a_reply_fits_its_command(command, reply):
    assert fits(command, reply)


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        ("command", "VQZd"),
        ("battery?", "ok"),
        ("takeoff", "87"),
        ("height?", "87"),
        ("sdk?", "unknown command: sn?"),
        ("takeoff", "forced stop"),
        ("sn?", "ok"),
        ("rc 0 0 0 0", "ok"),
        ("emergency", "ok"),
    ],
)
def test_a_reply_to_another_command_does_not_fit(command, reply):
    assert not fits(command, reply)


@pytest.mark.parametrize(
    ("query", "reply"),
    [
        ("battery?", "87"),
        ("height?", "12dm"),
        ("height?", "-1dm"),
        ("tof?", "801mm"),
        ("speed?", "100.0"),
        ("time?", "12s"),
        ("temp?", "62~65C"),
        ("baro?", "-42.45"),
        ("attitude?", "pitch:-90;roll:0;yaw:180;"),
        ("acceleration?", "agx:0.00;agy:0.00;agz:-1000.00;"),
    ],
)
def test_the_reply_to_a_query_fits_it(query, reply):
    assert fits(query, reply)
    assert not refused(reply)


def test_only_repeatable_commands_are_sent_again():
    once = {"takeoff", "throwfly", "flip", "up", "forward", "cw", "go", "curve", "jump", "ap", "wifi", "reboot"}
    assert all(RULES[name].resend == 0 for name in once)
    assert rule("forward 100").resend == rule("no such command").resend == 0
    assert RULES["land"].resend > 0
    assert refused("error")
    assert not refused("ok")

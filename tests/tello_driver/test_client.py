import pytest
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_tello.client import EMERGENCIES, LONGEST_QUEUE, MOST_OWED, CommandOutcome, TelloClient
from flockwire_tello.commands import RULES
from hypothesis import given
from hypothesis import strategies as st

MS = SECOND // 1000
POLL = 20 * MS
LONG = 1000.0  # s


class Talk:
    """A client, and what it sent and what ended, at a time of its own."""

    def __init__(self):
        self.client, self.now = TelloClient(), 5 * SECOND
        self.sent, self.ended = [], []

    def poll(self):
        datagrams, finished = self.client.poll(self.now)
        self.sent += [datagram.decode() for datagram in datagrams]
        self.ended += [(end.command, end.outcome, end.reply) for end in finished]

    def send(self, *commands):
        for command in commands:
            self.client.send(command, self.now)
        self.poll()

    def hear(self, datagram):
        self.client.receive(datagram, self.now)
        self.poll()

    def wait(self, seconds):
        """Poll at a rate like a driver's."""
        end = self.now + nanoseconds(seconds)
        while self.now < end:
            self.now = min(end, self.now + (POLL if seconds < LONG else SECOND))
            self.poll()


@pytest.fixture
def talk():
    """Return a talk that has not begun."""
    return Talk()


def test_a_reply_ends_its_command_with_its_latency(talk):
    talk.send("command")
    talk.now += 30 * MS
    talk.client.receive(b"ok", talk.now)
    _, (end,) = talk.client.poll(talk.now)
    assert (end.command, end.outcome, end.reply, end.latency) == (
        "command",
        CommandOutcome.DONE,
        "ok",
        pytest.approx(0.03),
    )
    assert talk.client.poll(talk.now + 1000 * SECOND) == ([], [])


def test_one_command_is_in_flight_at_a_time(talk):
    talk.send("battery?", "height?")
    assert talk.sent == ["battery?"]
    talk.hear(b"87\r\n")
    assert talk.sent == ["battery?", "height?"]
    talk.hear(b"3dm\r\n")
    assert talk.ended == [("battery?", CommandOutcome.DONE, "87"), ("height?", CommandOutcome.DONE, "3dm")]


def test_a_query_is_sent_again_then_given_up(talk):
    talk.send("battery?")
    talk.wait(10)
    assert talk.sent == ["battery?"] * 3
    assert talk.ended == [("battery?", CommandOutcome.TIMED_OUT, "")]


def test_take_off_is_never_sent_twice(talk):
    talk.send("takeoff")
    talk.wait(60)
    assert talk.sent == ["takeoff"]
    assert talk.ended == [("takeoff", CommandOutcome.TIMED_OUT, "")]


def test_a_refusal_reports_why(talk):
    talk.send("takeoff")
    talk.hear(b"error Motor stop")
    assert talk.ended == [("takeoff", CommandOutcome.REFUSED, "error Motor stop")]


@pytest.mark.parametrize("first", [[bytes(range(0xCC, 0xE8)) + b"VQZd", b"ok"], [b"\xcc\xfe\x01ok"]])
def test_junk_before_or_in_the_first_reply_shifts_nothing(talk, first):
    talk.send("command", "sdk?")
    for datagram in first:
        talk.hear(datagram)
    talk.hear(b"20")
    assert talk.ended == [("command", CommandOutcome.DONE, "ok"), ("sdk?", CommandOutcome.DONE, "20")]


def test_a_late_reply_is_not_taken_for_the_next_command_s(talk):
    talk.send("forward 100", "battery?", "up 20")
    talk.wait(60.1)
    assert talk.sent == ["forward 100", "battery?"]
    talk.hear(b"ok")  # of the movement
    talk.hear(b"87")
    talk.wait(0.1)
    assert talk.ended[0] == ("forward 100", CommandOutcome.TIMED_OUT, "")
    assert talk.ended[1] == ("battery?", CommandOutcome.DONE, "87")
    assert talk.sent[-1] == "up 20"


def test_what_may_not_be_sent_again_waits_until_no_reply_is_owed(talk):
    talk.send("command")
    talk.wait(1.1)
    talk.hear(b"ok")  # one of two
    assert talk.sent == ["command", "command"]
    talk.send("takeoff")
    assert talk.sent == ["command", "command"]
    talk.hear(b"ok")  # the other
    talk.wait(0.01)
    assert talk.sent[-1] == "takeoff"
    assert [end[0] for end in talk.ended] == ["command"]


def test_a_reply_that_was_lost_holds_the_next_command_up_for_a_moment_only(talk):
    talk.send("command")
    talk.wait(1.1)
    talk.hear(b"ok")
    talk.send("takeoff")
    talk.wait(RULES["command"].late + 0.01)
    assert talk.sent[-1] == "takeoff"


def test_rc_never_waits_and_only_the_newest_is_sent(talk):
    talk.send("takeoff", "rc 1 2 3 4", "rc 5 6 7 8")
    assert talk.sent == ["rc 5 6 7 8", "takeoff"]
    talk.send("rc 0 0 0 0")
    assert talk.sent[-1] == "rc 0 0 0 0"
    assert talk.ended == []


def test_emergency_is_sent_three_times_and_ends_all_else(talk):
    talk.send("takeoff", "rc 1 2 3 4", "battery?")
    talk.sent.clear()
    talk.send("rc 1 1 1 1", "emergency")
    assert talk.sent == ["emergency"] * EMERGENCIES
    assert talk.ended == [("takeoff", CommandOutcome.SUPERSEDED, ""), ("battery?", CommandOutcome.SUPERSEDED, "")]


def test_land_does_not_wait_for_a_movement(talk):
    talk.send("forward 500", "up 20")
    talk.send("land")
    assert talk.sent == ["forward 500", "land"]
    assert talk.ended == [("forward 500", CommandOutcome.SUPERSEDED, ""), ("up 20", CommandOutcome.SUPERSEDED, "")]
    talk.hear(b"error")  # of the movement
    talk.now += SECOND
    talk.hear(b"ok")
    assert talk.ended[-1] == ("land", CommandOutcome.DONE, "ok")


def test_land_again_and_again_is_one_landing(talk):
    for _ in range(10):
        talk.send("land")
        talk.now += 10 * MS
    assert talk.sent == ["land"]


def test_replies_to_nothing_are_dropped(talk):
    talk.hear(b"ok\r\nforced stop")
    talk.send("battery?")
    assert talk.ended == []


def test_several_replies_in_a_datagram_are_all_taken(talk):
    talk.send("forward 100")
    talk.send("stop")
    talk.hear(b"ok\r\nok\r\n")
    assert talk.ended[-1] == ("stop", CommandOutcome.DONE, "ok")


def test_the_newest_state_counts_and_malformed_ones_are_counted(talk):
    state = b"pitch:0;roll:0;yaw:0;vgx:0;vgy:0;vgz:0;templ:0;temph:0;tof:10;h:0;bat:%d;baro:0.00;\r\n"
    talk.client.receive_state(state % 50 + state % 49, 7)
    talk.client.receive_state(b"ok", 8)
    assert (talk.client.state.bat, talk.client.state_time) == (49, 7)
    assert talk.client.malformed_states == 1


@pytest.mark.parametrize("command", ["", "land\r\n", "a" * 300, "flüg"])
def test_what_is_no_command_is_rejected(talk, command):
    with pytest.raises(ValueError, match="a command is one line"):
        talk.client.send(command, talk.now)


def test_a_full_queue_reports_it(talk):
    talk.send(*["battery?"] * (LONGEST_QUEUE + 1))
    assert talk.ended == [("battery?", CommandOutcome.QUEUE_FULL, "")]


actions = st.one_of(
    st.sampled_from([*RULES, "forward 50", "rc 1 2 3 4", "sleep"]).map(lambda name: ("send", name)),
    st.one_of(st.binary(max_size=40), st.sampled_from([b"ok", b"error", b"87\r\n", b"forced stop"])).map(
        lambda data: ("hear", data)
    ),
    st.floats(0.0, 30.0).map(lambda seconds: ("wait", seconds)),
)


@given(st.lists(actions, max_size=60))
def test_whatever_happens_commands_end_once_and_memory_stays_flat(script):
    talk, given_up = Talk(), []
    for verb, what in script:
        getattr(talk, verb)(what)
        if verb == "send" and what.split()[0] not in ("rc", "emergency"):
            given_up.append(what)
    talk.wait(5000)
    assert talk.client.poll(talk.now + 1000 * SECOND) == ([], [])
    assert len(talk.client._owed) <= MOST_OWED
    ended = [end[0] for end in talk.ended]
    assert len(ended) <= len(given_up)
    assert set(ended) == set(given_up)
    assert talk.sent.count("takeoff") <= given_up.count("takeoff")

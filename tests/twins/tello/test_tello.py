from math import pi
from random import Random

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_tello.commands import RULES, fits, split_replies
from flockwire_twins.tello.parameters import TelloParameters
from flockwire_twins.tello.tello import NOT_TEXT, SimulatedTello
from hypothesis import given
from hypothesis import strategies as st


def test_it_is_silent_until_it_is_commanded(talk):
    here = talk(enter=False)
    assert here.ask("battery?", 1.0) is None
    assert here.states == []
    here.ask("command", 1.05)
    assert [(datagram, 0.028 <= after <= 0.048) for after, datagram, _ in here.replies] == [(b"ok", True)]
    assert len(here.states) == 10
    assert {address for _, address in here.states} == {("127.0.0.9", 8890)}


def test_state_goes_to_whoever_commanded_last(talk):
    here = talk()
    here.ask("command", 0.1, ("127.0.0.8", 8889))
    here.states.clear()
    here.run(0.5)
    assert {address for _, address in here.states} == {("127.0.0.8", 8890)}


def test_take_off_and_landing_take_their_time(talk):
    here = talk()
    assert here.ask("takeoff", 6.0) == b"ok"
    assert here.replies[0][0] == pytest.approx(3.9, abs=0.1)
    assert 0.8 < here.position[2] < 1.2
    assert (here.state.h, here.state.tof) == (100, pytest.approx(100, abs=5))
    assert here.state.time == 5
    assert here.ask("land", 4.0) == b"ok"
    assert here.replies[0][0] == pytest.approx(1.7, abs=0.2)
    assert here.position[2] == 0.0
    motors = here.state.time
    here.run(3.0)
    assert here.state.time == motors
    assert (here.state.tof, here.state.agz) == (10, pytest.approx(-1000, abs=2))


@pytest.mark.parametrize(
    ("command", "way"),
    [
        ("forward 100", (1.0, 0.0, 0.0)),
        ("back 100", (-1.0, 0.0, 0.0)),
        ("left 50", (0.0, 0.5, 0.0)),
        ("right 50", (0.0, -0.5, 0.0)),
        ("up 20", (0.0, 0.0, 0.2)),
        ("down 20", (0.0, 0.0, -0.2)),
        ("go 50 -60 30 60", (0.5, -0.6, 0.3)),
        ("curve 50 50 0 100 0 0 40", (1.0, 0.0, 0.0)),
    ],
)
def test_movements_arrive_then_answer(flying, command, way):
    here = flying()
    before = here.position
    assert here.ask(command, 12.0) == b"ok"
    assert here.replies[0][0] > 0.5
    assert [b - a for a, b in zip(before, here.position, strict=True)] == pytest.approx(way, abs=0.05)


def test_a_movement_keeps_its_speed(flying):
    here = flying()
    here.ask("speed 20")
    here.ask("forward 100", 3.0)
    assert here.replies == []
    assert here.tello.flight.airframe.motion(here.now).velocity[0] == pytest.approx(0.2, abs=0.01)
    assert here.state.vgx == 2


def test_turns_are_clockwise_and_the_next_movement_faces_there(flying):
    here = flying(yaw=pi / 2)
    assert here.ask("cw 90", 6.0) == b"ok"
    assert here.state.yaw == pytest.approx(90, abs=1)
    assert here.ask("ccw 180", 8.0) == b"ok"
    assert here.state.yaw == pytest.approx(-90, abs=1)
    assert here.ask("forward 100", 6.0) == b"ok"
    assert here.position == pytest.approx((-1.0, 0.0, here.position[2]), abs=0.1)


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        ("forward 19", b"out of range"),
        ("forward 501", b"out of range"),
        ("forward", b"error"),
        ("forward x", b"error"),
        ("forward 1-", b"error"),
        ("cw 0", b"out of range"),
        ("cw 361", b"out of range"),
        ("go 10 10 10 50", b"out of range"),
        ("go 0 0 501 50", b"out of range"),
        ("go 50 50 50 5", b"out of range"),
        ("go 50 50 50 50 m1", b"error No valid marker"),
        ("curve 50 50 0 100 0 0 61", b"out of range"),
        ("curve 50 0 0 100 0 0 40", b"error Radius is too large!"),
        ("flip x", b"error"),
        ("speed 101", b"out of range"),
        ("mdirection 3", b"out of range"),
        ("takeoff", b"error"),
        ("dance 3", b"unknown command: dance 3"),
        ("hardware?", b"unknown command: hardware?"),
        ("streamon", b"ok"),
        ("sdk?", b"20"),
    ],
)
def test_what_cannot_be_done_is_refused_as_a_real_one_does(flying, command, reply):
    here = flying()
    before = here.position
    assert here.ask(command, 1.0) == reply
    assert here.position == pytest.approx(before, abs=1e-3)


def test_on_the_ground_nothing_moves(talk):
    here = talk()
    assert here.ask("forward 50") == b"error Motor stop"
    assert here.ask("land") == b"error"
    assert here.ask("rc 0 50 0 0", 2.0) is None
    assert here.position == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("generation", ["1.3", "2.0", "3.0"])
def test_every_query_is_answered_in_the_form_that_clients_read(flying, generation):
    here = flying(generation=generation)
    for query in (name for name in RULES if name.endswith("?")):
        (reply,) = split_replies(here.ask(query))
        assert fits(query, reply), (query, reply)


def test_later_generations_know_more(talk):
    assert talk(generation="1.3").ask("sdk?") == b"unknown command: sdk?"
    assert talk(generation="1.3").state.pad is None
    here = talk(generation="3.0")
    assert here.ask("hardware?") == b"RMTT"
    assert here.ask("EXT led 1 2 3") == b"led ok"
    assert here.ask("EXT mled g 0") == b"matrix ok"
    assert here.ask("EXT tof?") == b"tof 8192"
    assert here.ask("EXT what") == b"unknown command: EXT what"
    assert here.ask("motoron", 2.5) == b"ok"
    assert here.state.time == 2
    assert here.ask("motoroff") == b"ok"
    assert here.ask("port 9001 9002", 0.2) == b"ok"
    assert here.ask("throwfly", 5.0) == b"ok"
    assert here.states[-1][1] == ("127.0.0.9", 9001)


def test_mission_pads_are_off_or_not_seen(talk):
    here = talk()
    assert here.state.pad[:4] == (-2, -200, -200, -200)
    here.ask("mon")
    assert here.state.pad == (-1, -100, -100, -100, (-1, -1, -1))
    here.ask("moff")
    assert here.state.pad.mid == -2


def test_the_sticks_follow_their_gains(flying):
    here = flying()
    assert here.ask("rc 0 50 0 0", 3.0) is None
    assert here.tello.flight.airframe.motion(here.now).velocity == pytest.approx((0.5, 0.0, 0.0), abs=1e-3)
    here.ask("rc -30 0 -20 0", 3.0)
    assert here.tello.flight.airframe.motion(here.now).velocity == pytest.approx((0.0, 0.3, -0.2), abs=1e-3)
    here.ask("rc 0 0 0 45", 2.0)
    assert here.tello.flight.airframe.motion(here.now).yaw_rate == pytest.approx(-pi / 4, abs=1e-3)
    here.ask("rc 200 0 0 0", 1.0)
    assert here.tello.flight.airframe.motion(here.now).yaw_rate == pytest.approx(-pi / 4, abs=1e-3)


def test_a_stop_ends_a_movement_with_three_replies(flying):
    here = flying()
    here.ask("forward 500", 1.0)
    here.ask("stop", 2.0)
    assert [datagram for _, datagram, _ in here.replies] == [b"forced stop", b"ok", b"ok"]
    assert here.tello.flight.airframe.motion(here.now).velocity == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_replies_keep_their_order(flying):
    here = flying(chance=Random(3).random)
    for _ in range(20):
        here.ask("forward 100", 0.1)
        here.ask("stop", 0.1)
        assert [datagram for _, datagram, _ in here.replies] == [b"forced stop", b"ok", b"ok"]


def test_land_ends_a_movement(flying):
    here = flying()
    here.ask("forward 500", 1.0)
    here.ask("land", 3.0)
    assert [datagram for _, datagram, _ in here.replies] == [b"error", b"ok"]
    assert here.position[2] == 0.0


def test_land_sent_again_is_answered_once(flying):
    here = flying()
    here.ask("land", 0.5)
    assert here.ask("land", 3.0) == b"ok"
    assert len(here.replies) == 1


def test_while_busy_a_movement_is_refused_and_queries_are_answered(flying):
    here = flying()
    here.ask("forward 300", 0.5)
    assert here.ask("up 20") == b"error"
    assert here.ask("battery?") == b"100\r\n"


def test_the_battery_drains_in_whole_percents_and_an_empty_one_lands_it(flying):
    here = flying(endurance=60.0, battery=0.3)
    first = here.state.bat
    here.ask("battery?", 6.0)
    assert first - here.state.bat == 10
    here.ask("rc 0 0 0 0", 10.0)
    assert here.position[2] == 0.0
    assert here.ask("takeoff") == b"error"


def test_flips_need_half_a_battery(flying):
    assert flying().ask("flip l", 3.0) == b"ok"
    assert flying(battery=0.4).ask("flip l") == b"error"


def test_a_new_network_restarts_it(talk):
    here = talk()
    assert here.ask("ap name password", 0.1) == b"OK,drone will reboot in 3s\0"
    assert here.ask("battery?", 1.0) is None
    here.run(3.0)
    assert here.ask("battery?") is None
    assert here.ask("command") == b"ok"


def test_two_with_one_seed_are_equal(talk):
    assert talk().ask("battery?") == talk().ask("battery?")


words = st.sampled_from(
    [*RULES, "forward 50", "go 50 50 50 50", "rc 9 9 9 9", "cw 5", "EXT led 1 1 1", "go -500 1 1 9"]
)


@given(st.lists(words.map(str.encode) | st.binary(max_size=300), max_size=25), st.sampled_from(["1.3", "2.0", "3.0"]))
def test_no_datagram_harms_it(datagrams, generation):
    tello, now = SimulatedTello(TelloParameters(generation=generation), 0), 0
    tello.receive(b"command", ("127.0.0.9", 9), 0)
    for datagram in datagrams:
        now += SECOND // 3
        tello.receive(datagram, ("127.0.0.9", 9), now)
        tello.outgoing(now)
        assert tello.next_deadline() >= now - SECOND // 50
    assert tello.flight.airframe.motion(now).position[2] >= 0.0


def test_uncollected_data_is_bounded():
    tello = SimulatedTello(TelloParameters(), 0)
    for k in range(2000):
        tello.receive(b"command", ("127.0.0.9", 9), k * SECOND // 10)
    assert len(tello.outgoing(200 * SECOND)) <= 256


@pytest.mark.parametrize(("name", "value"), [("lag", -1.0), ("dead_time", float("nan")), ("loss", 2.0)])
def test_impossible_parameters_are_rejected(name, value):
    with pytest.raises(ValueError, match=f"{name} = "):
        TelloParameters(**{name: value})


@pytest.mark.parametrize("generation", ["2.0", "3.0"])
def test_each_repetition_of_the_robomaster_sdk_is_answered_as_the_movement_ends(talk, generation):
    found = talk(enter=False, generation=generation)
    assert found.ask("Re0101 command") == b"Re0101 ok"
    for repetition in range(1, 6):  # it sends five at once, and waits for five answers
        assert found.ask(f"Re550{repetition} takeoff", 0.0) is None
    found.run(1.0)
    assert found.replies == []
    assert found.ask("Re5505 takeoff", 0.1) is None  # one that comes twice is answered once
    found.run(4.0)
    assert [datagram for _, datagram, _ in found.replies] == [b"Re550%d ok" % repetition for repetition in range(1, 6)]
    assert found.ask("Re5506 takeoff") == b"Re5506 ok"  # the answers were lost
    assert found.state.h >= 90
    before = found.position[0]
    for repetition in range(1, 4):
        assert found.ask(f"Re880{repetition} forward 50", 6.0) == b"Re880%d ok" % repetition
    assert found.position[0] - before == pytest.approx(0.5, abs=0.05)
    assert found.ask("Re8901 takeoff") == b"Re8901 error"
    assert found.ask("Re9001 battery?", 0.2).startswith(b"Re9001 ")
    assert found.ask("battery?", 0.2).strip().isdigit()


def test_an_interrupted_movement_answers_each_repetition_of_the_robomaster_sdk(talk):
    found = talk(generation="3.0")
    found.ask("Re0101 takeoff", 5.0)
    for repetition in (1, 2):
        found.ask(f"Re020{repetition} forward 300", 0.0)
    found.ask("stop", 0.5)
    answers = {datagram for _, datagram, _ in found.replies}
    assert {b"Re0201 forced stop", b"Re0202 forced stop", b"Re0201 ok", b"Re0202 ok", b"ok"} == answers


def test_an_early_tello_knows_no_numbered_commands(talk):
    assert talk(generation="1.3").ask("Re8701 takeoff") == b"unknown command: Re8701 takeoff"


def test_what_is_no_text_is_named_once_for_whoever_watches():
    lines = []
    tello = SimulatedTello(TelloParameters(), 0, note=lines.append)
    tello.receive(b"command\r\n", ("127.0.0.9", 9), 0)
    assert lines == []
    for datagram in (b"conn_req:\x96\x17", b"\xcc\x58\x00\x7c", b"Re\x01\x02\x01\x07 takeoff"):
        tello.receive(datagram, ("127.0.0.8", 8889), 0)
    assert lines == [NOT_TEXT.format("127.0.0.8", 8889)]


def test_a_stream_sends_pictures_to_the_video_port(talk):
    here = talk()
    assert here.ask("streamon", 0.3) == b"ok"
    assert {address for _, address in here.video} == {("127.0.0.9", 11111)}
    video = b"".join(datagram for datagram, _ in here.video)
    assert [unit[0] & 0x1F for unit in video.split(b"\0\0\0\1")[1:]] == [7, 8, 5] * 3  # parameters, then a picture
    here.ask("streamoff")
    here.video.clear()
    here.run(0.5)
    assert here.video == []


@pytest.mark.parametrize(("quirks", "reply"), [((), b"active"), (("not-activated",), b"inactive")])
def test_a_tt_says_whether_it_was_activated(talk, quirks, reply):
    assert talk(*quirks, generation="3.0").ask("active?") == reply

from random import Random

import pytest
from flockwire_tello.client import TelloClient
from flockwire_twins.tello.parameters import USUAL, Quirk, switched
from flockwire_twins.tello.tello import JUNK

OTHER = ("127.0.0.9", 50000)
BOUND = ("127.0.0.9", 8889)


def test_quirks_are_switched_by_name():
    assert switched(["low-battery", "no-auto-land"]) == USUAL - {Quirk.AUTO_LAND} | {Quirk.LOW_BATTERY}
    assert Quirk.NO_EMERGENCY_REPLY in switched([])
    assert Quirk.NO_EMERGENCY_REPLY not in switched(["no-no-emergency-reply"])
    with pytest.raises(ValueError, match=r"'wings': must be one of auto-land, .*; or no-NAME"):
        switched(["wings"])


def test_every_quirk_says_what_it_is():
    assert all(len(quirk.__doc__) > 30 and quirk.value.islower() for quirk in Quirk)


def test_auto_land(flying):
    here = flying()
    here.ask("battery?", 14.0)
    assert here.position[2] > 0.8
    here.run(4.0)
    assert here.position[2] == 0.0
    assert len(here.replies) == 1
    here = flying("no-auto-land")
    here.run(30.0)
    assert here.position[2] > 0.8


def test_sticks_stay(flying):
    here = flying()
    here.ask("rc 0 50 0 0", 10.0)
    assert here.position[0] > 4.0
    here = flying("no-sticks-stay")
    here.ask("rc 0 50 0 0", 10.0)
    assert here.position[0] < 0.4


def test_no_emergency_reply(flying):
    here = flying()
    assert here.ask("emergency", 1.0) is None
    assert here.position[2] == 0.0
    assert flying("no-no-emergency-reply").ask("emergency", 1.0) == b"ok"


def test_not_joystick(flying):
    here = flying("not-joystick")
    assert here.ask("up 20", 4.0) == here.ask("down 20", 4.0) == b"ok"
    assert here.ask("up 20", 4.0) == b"error Not joystick"
    assert here.ask("up 20", 4.0) == b"ok"


def test_no_valid_imu(flying):
    here = flying("no-valid-imu")
    assert here.ask("up 20") == b"error No valid imu"
    here.ask("rc 0 50 0 0", 2.0)
    assert here.position[0] > 0.5


@pytest.mark.parametrize("quirk", ["not-activated", "low-battery"])
def test_refused_take_off(talk, quirk):
    here = talk(quirk)
    assert here.ask("takeoff", 5.0) == b"error"
    assert here.position[2] == 0.0
    assert (here.state.bat == 8) == (quirk == "low-battery")


def test_second_session_hangs(talk):
    here = talk("second-session-hangs")
    assert here.ask("command", sender=OTHER) is None
    assert here.ask("takeoff", 5.0, sender=OTHER) is None
    assert here.position[2] > 0.8
    assert here.ask("command", sender=BOUND) == b"ok"


def test_lost_datagrams(talk):
    here = talk("lost-datagrams", chance=Random(1).random, loss=0.2, enter=False)
    answered = sum(here.ask("command") is not None for _ in range(500))
    assert answered / 500 == pytest.approx(0.8 * 0.8, abs=0.05)
    share = len(here.states) / 500
    assert share == pytest.approx(0.8, abs=0.05)


def test_late_replies(talk):
    here = talk("late-replies")
    found = [here.ask("battery?", 2.0) and here.replies[0][0] for _ in range(4)]
    assert [after > 1.5 for after in found] == [False, False, True, False]


@pytest.mark.parametrize("quirk", ["junk-before-first-reply", "junk-in-first-reply"])
def test_junk_and_how_the_client_takes_it(talk, quirk):
    here = talk(quirk, enter=False)
    here.ask("command")
    datagrams = [datagram for _, datagram, _ in here.replies]
    assert datagrams == ([JUNK, b"ok"] if quirk == "junk-before-first-reply" else [JUNK[:8] + b"ok"])
    client = TelloClient()
    client.send("command", 0)
    client.poll(0)
    for datagram in datagrams:
        client.receive(datagram, 1)
    _, (end,) = client.poll(1)
    assert end.reply == "ok"
    assert here.ask("command") == b"ok"

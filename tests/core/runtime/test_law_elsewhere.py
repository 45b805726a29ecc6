"""A law in another process: what goes out is what is declared, late answers and bad ones are named."""

from __future__ import annotations

import math
import socket
import struct
import tomllib
from pathlib import Path
from threading import Thread

import pytest
from flockwire_agent.guarded_law import GuardedLaw
from flockwire_core.follower_law import LateAnswerError, follower_law
from flockwire_core.law import Body, BodyKind, Heard, Information, Observation, Output, Pace, Place, Seen, Sense
from flockwire_core.loading import SwarmFileError, parse_swarm
from flockwire_core.runtime.law_elsewhere import MOST
from flockwire_core.wire.information import declared, numbers
from flockwire_core.wire.observed_numbers import ObservedNumbers

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "laws/elsewhere/consensus.toml"


def read_frame(end):
    data = end.recv(8, socket.MSG_WAITALL)
    if len(data) < 8:
        return None
    count, zero = struct.unpack("<II", data)
    assert zero == 0
    return struct.unpack(f"<{count}d", end.recv(8 * count, socket.MSG_WAITALL))


def write_frame(end, *values):
    end.sendall(struct.pack("<II", len(values), 0) + struct.pack(f"<{len(values)}d", *values))


@pytest.fixture
def served(tmp_path):
    """Serve a Unix socket by `answer(end, frame)`; returns the maker of the swarm that asks it, and all frames."""
    doors, frames = [], []

    def serve(answer, **changes):
        door = socket.socket(socket.AF_UNIX)
        door.bind(str(tmp_path / "law.sock"))
        door.listen(8)
        doors.append(door)

        def attend(end):
            with end:
                while (frame := read_frame(end)) is not None:
                    frames.append(frame)
                    if frame[0] >= 1 and len(frame) > 0 and frames.index(frame) > 0:
                        answer(end, frame)

        def accept():
            while True:
                try:
                    end, _ = door.accept()
                except OSError:
                    return
                Thread(target=attend, args=(end,), daemon=True).start()

        Thread(target=accept, daemon=True).start()
        return swarm("socket:law.sock", tmp_path, **changes), frames

    yield serve
    for door in doors:
        door.shutdown(socket.SHUT_RDWR)
        door.close()


def table(law="socket:law.sock", **information):
    found = tomllib.loads(EXAMPLE.read_text())
    found["control"]["law"] = law
    found["control"]["information"] |= information
    return found


def swarm(law, folder, **information):
    from flockwire_core.swarm.model import Swarm

    return Swarm.model_validate(table(law, **information) | {"folder": str(folder)})


def numbers_of(where, number):
    return ObservedNumbers(declared(where), where.topology.neighbours(number))


SEEN = Observation(t=2.0, dt=0.01, neighbours=[Seen(1, 1.0, False, position=(0.5, 0.25, 0.125))])


def test_the_first_frame_and_an_observation_are_as_documented(served):
    where, frames = served(lambda end, frame: write_frame(end, frame[0], 1.0, 2.0, 3.0, 0.5))
    law = follower_law(where, 3)
    decision = law.step(SEEN)
    assert (decision.command, decision.error, decision.message) == ((1.0, 2.0, 3.0), 0.5, None)
    first, observed = frames
    assert first[:8] == (1.0, 3.0, 0.01, 0.0, 0.0, where.full_speed(3), where.limits.acceleration, 1.0)
    assert first[8:] == (1.0, 1.0, 0.0, 1.0, 1.0)  # neighbour 1, its weight, no leader; one parameter, 1
    names = numbers_of(where, 3).names
    assert len(observed) == 1 + len(names)
    assert observed[0] == 1.0
    found = dict(zip(names, observed[1:], strict=True))
    assert found["in formation"] == 0.0
    assert (found["t"], found["dt"], found["sees 1"]) == (2.0, 0.01, 1.0)
    assert [found[f"1: position {axis}"] for axis in "xyz"] == [0.5, 0.25, 0.125]


def test_an_answer_that_is_late_is_counted_and_dropped(served):
    waiting = []

    def answer(end, frame):
        if frame[0] == 2.0:
            waiting.append(end)  # until the next but one
        elif frame[0] == 3.0:
            write_frame(end, 3.0, 3.0, 0.0, 0.0, math.nan)
        else:
            write_frame(end, frame[0], frame[0], 0.0, 0.0, math.nan)

    where, _ = served(answer)
    law = GuardedLaw(lambda: follower_law(where, 3, 0.1), "uav3", None, declared(where))
    assert law.step(SEEN).command[0] == 1.0
    for late in (1, 2):  # the second step waits for the answer to the first
        assert law.step(SEEN) is None
        assert (law.is_late, law.steps_late, law.command, law.failure) == (True, late, (0.0, 0.0, 0.0), None)
    write_frame(waiting[0], 2.0, 2.0, 0.0, 0.0, math.nan)
    assert law.step(SEEN).command[0] == 3.0
    assert not law.is_late


def test_a_step_that_has_no_time_to_ask_awaits_no_answer(served, monkeypatch):
    where, _ = served(lambda end, frame: write_frame(end, frame[0], frame[0], 0.0, 0.0, math.nan))
    law = follower_law(where, 3)
    assert law.step(SEEN).command[0] == 1.0
    with monkeypatch.context() as patch:
        patch.setattr("flockwire_core.runtime.law_elsewhere.clock.monotonic", iter((0, 10**12)).__next__)
        with pytest.raises(LateAnswerError):
            law.step(SEEN)
    assert law.step(SEEN).command[0] == 2.0


def test_of_rounds_no_message_is_skipped_though_a_step_is_late(served, monkeypatch):
    where, frames = served(lambda end, frame: write_frame(end, frame[0], 0.0, 0.0, 0.0, 0.0), message=2, pace="round")
    law, content = follower_law(where, 3), numbers(2)((3.0, 4.0))
    told = [Observation(news=[Heard(1, 1.0, False, 1, k, content)]) for k in range(1, MOST + 2)]
    with monkeypatch.context() as patch:
        patch.setattr("flockwire_core.runtime.law_elsewhere.clock.monotonic", iter((0, 10**12)).__next__)
        with pytest.raises(LateAnswerError):
            law.step(told[0])
    for observation in (told[1], SEEN):
        law.step(observation)
    assert frames[-2][-9:] == (2.0, 1.0, 1.0, 3.0, 4.0, 1.0, 2.0, 3.0, 4.0)
    assert frames[-1][-1] == 0.0
    with pytest.raises(ConnectionError, match="late for too long"):
        law.step(Observation(news=[one.news[0] for one in told]))


@pytest.mark.parametrize(
    ("pace", "sent"), [("round", [2.0, 3.0, 4.0]), ("event", [2.0, 3.0, 4.0]), ("step", [3.0, 4.0])]
)
def test_the_message_of_a_late_answer_is_sent_before_the_next(pace, sent, served):
    waiting, kind = [], numbers(1)

    def answer(end, frame):
        if frame[0] == 2.0:
            waiting.append(end)
        else:
            write_frame(end, frame[0], 0.0, 0.0, 0.0, 0.0, *([frame[0]] if 2.0 < frame[0] < 5.0 else []))

    where, _ = served(answer, message=1, pace=pace)
    law = follower_law(where, 3, 0.1)
    assert law.step(SEEN).message is None
    with pytest.raises(LateAnswerError):
        law.step(SEEN)
    write_frame(waiting[0], 2.0, 0.0, 0.0, 0.0, 0.0, 2.0)
    messages = [law.step(SEEN).message for _ in range(4)]
    assert [one for one in messages if one is not None] == [kind((value,)) for value in sent]


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (lambda end, frame: write_frame(end, frame[0], 1.0), "a decision of 2 numbers, must be 5"),
        (lambda end, frame: write_frame(end, frame[0], math.inf, 0.0, 0.0, 0.0), "not finite"),
        (lambda end, _: write_frame(end, 7e9, 1.0, 0.0, 0.0, 0.0), "a decision of step 7e+09, must be 1"),
        (lambda end, _: write_frame(end, math.inf, 1.0, 0.0, 0.0, 0.0), "a decision of step inf, must be 1"),
        (lambda end, _: end.sendall(struct.pack("<II", 1 << 30, 0)), "a decision of 1073741824 numbers"),
        (lambda end, _: end.shutdown(socket.SHUT_RDWR), "the program has closed the connection"),
    ],
)
def test_a_bad_answer_fails_the_law_and_says_why(served, answer, text):
    where, _ = served(answer)
    law = GuardedLaw(lambda: follower_law(where, 3), "uav3", None, declared(where))
    assert law.step(SEEN) is None
    assert text in law.failure.text


def test_messages_go_both_ways(served):
    where, frames = served(lambda end, frame: write_frame(end, frame[0], 0.0, 0.0, 0.0, 0.0, 7.0, 8.0), message=2)
    kind = numbers(2)
    law = follower_law(where, 3)
    heard = [Heard(1, 1.0, False, 1_000_000_000, 5, kind((3.0, 4.0)))]
    assert law.step(Observation(heard=heard, now=1_500_000_000)).message == kind((7.0, 8.0))
    found = dict(zip(numbers_of(where, 3).names, frames[-1][1:], strict=True))
    assert [found[name] for name in ("heard 1", "1: age", "1: message 0", "1: message 1")] == [5.0, 0.5, 3.0, 4.0]


def test_a_socket_that_nobody_serves_is_refused_with_the_remedy(tmp_path):
    for law, why in (("socket:law.sock", "No such file"), ("tcp:1", "Connection refused")):
        with pytest.raises(SwarmFileError, match="start the program of the law first") as refused:
            parse_swarm(table(law) | {"folder": str(tmp_path)}, "mine.toml")
        assert str(refused.value).startswith(f"mine.toml: control.law = '{law}': nobody serves it ({why}")
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("law", "text"),
    [
        ("tcp:0", "must be tcp:PORT"),
        ("tcp:no", "must be tcp:PORT"),
        ("socket:", "must be socket:PATH"),
        ("consensus", "remove the table"),
    ],
)
def test_a_bad_place_is_refused(law, text):
    with pytest.raises(SwarmFileError, match=text):
        parse_swarm(table(law), "mine.toml")


@pytest.mark.parametrize("pace", ["round", "event"])
def test_a_pace_without_messages_is_refused(pace):
    with pytest.raises(SwarmFileError) as refused:
        parse_swarm(table("tcp:5555", pace=pace), "mine.toml")
    assert str(refused.value) == f"mine.toml: control.information.message = 0: must be above 0 with pace = '{pace}'"


def test_the_file_declares_what_a_class_would(tmp_path):
    told = declared(
        swarm(
            "tcp:5555", tmp_path, neighbours=["bearing", "velocity"], around=["position"], radius=2.0, named=True,
            own=["position"], output="acceleration", message=3, pace="event", silence=0.5, leaders=[0, 2],
            directed=False, signed=True, planar=True,
        )
    )  # fmt: skip
    assert told == Information(
        Sense.BEARING | Sense.VELOCITY, Sense.POSITION, 2.0, True, Sense.POSITION, Output.ACCELERATION, numbers(3),
        Pace.EVENT, 0.5, (0, 2), False, True, True,
    )  # fmt: skip


def test_all_numbers_have_their_places(tmp_path):
    where = swarm(
        "tcp:5555", tmp_path, neighbours=["bearing", "distance", "velocity"], around=["position"], radius=2.0,
        named=True, own=["position", "velocity"],
    )  # fmt: skip
    told = numbers_of(where, 4)
    formation = where.build_formation()
    seen = Seen(3, 0.5, False, (0.0, 1.0, 0.0), 2.0, None, (0.1, 0.2, 0.3))
    observation = Observation(
        t=1.0, dt=0.02, position=(1.0, 2.0, 3.0), velocity=(4.0, 5.0, 6.0), neighbours=[seen],
        around=[Seen(8, position=(9.0, 9.0, 9.0)), Seen(9, position=(7.0, 8.0, 9.0))],
        bodies=[Body(BodyKind.OBSTACLE, (1.0, 1.0, 0.0), 0.3)],
        place=Place(formation, 3, ranks={2: 1, 3: 2}),
    )  # fmt: skip
    found = dict(zip(told.names, told.of(observation), strict=True))

    def three(name):
        return tuple(found[f"{name} {axis}"] for axis in "xyz")

    assert (three("own position"), three("own velocity")) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    assert three("h") == formation.offset(3, 1.0)
    assert three("h - h of 3") == pytest.approx(Place(formation, 3, ranks={3: 2}).to(3, 1.0))
    assert (found["sees 2"], found["sees 3"], found["3: distance"]) == (0.0, 1.0, 2.0)
    assert (three("2: bearing"), three("3: bearing")) == ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert three("3: velocity") == (0.1, 0.2, 0.3)
    assert (found["sees around 0"], three("around 0: position"), found["around 0: number"]) == (1.0, (7.0, 8.0, 9.0), 9)
    assert (found["sees around 1"], found["around 1: number"]) == (1.0, 8.0)
    assert (found["sees around 2"], found["around 2: number"]) == (0.0, -1.0)
    assert (found["body 0"], found["body 0: kind"], found["body 0: radius"], found["body 1"]) == (1.0, 1.0, 0.3, 0.0)
    assert "3: position x" not in found

"""A law records numbers by name: they are in the trace, for each follower, and nobody else receives them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from flockwire_agent.extended_law import ExtendedLaw
from flockwire_analysis.export import tables
from flockwire_analysis.figures import draw
from flockwire_analysis.phases import origin
from flockwire_analysis.reading import read_trace
from flockwire_analysis.replay import flight_data
from flockwire_core.domain.law_message import LONGEST_NAME, MOST_SIGNALS, Signals
from flockwire_core.domain.time import SECOND
from flockwire_core.law import Decision, LawSettings, LeaderMotion, Observation, check_decision, norm, subtract
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import decode, encode
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_lab.flight import Flight, fly_recorded
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

FOLLOWERS = (1, 2)
LAW = "recording_law:Recording"


class Recording(ExtendedLaw):
    """The extended law with a Lyapunov function, half the square of the formation error."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self._number = settings.number

    def step(self, observation: Observation) -> Decision:
        decision, place, motion = super().step(observation), observation.place, observation.motion
        if place is None or motion is None or decision.message is None:
            return decision
        error = subtract(subtract(motion.position, place.offset(observation.t)), decision.message.position)
        energy = {"V": 0.5 * norm(error) ** 2, "number": self._number}
        return Decision(decision.command, decision.message, signals=energy)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory, make_swarm: Callable[..., Swarm]) -> Path:
    """Fly a swarm whose law records, and return its trace."""
    sys.modules["recording_law"] = sys.modules[__name__]
    swarm = make_swarm(
        {
            "control.law": LAW,
            "graph.edges": [[0, 1], [1, 2]],
            "drones": [{"id": i, "start": [1.0 * i, 0.5, 0.0]} for i in (0, *FOLLOWERS)],
        }
    )
    path = tmp_path_factory.mktemp("signals") / "trace.mcap"
    assert fly_recorded(Flight(swarm, 0, 5.0), "", path, lambda _: None).failure == ""
    return path


def test_a_laws_numbers_are_in_the_trace_by_follower_and_name(recorded: Path) -> None:
    trace = read_trace(recorded)
    assert [(number, *signals) for number, signals in trace.signals.items()] == [(i, "V", "number") for i in FOLLOWERS]
    for number, signals in trace.signals.items():
        energy, own = signals["V"], signals["number"]
        assert len(energy.stamps) > 250
        assert (np.diff(energy.stamps) > 0).all()
        assert energy.stamps[0] >= trace.missions[0].start
        assert energy.values[-1] < 0.01 * energy.values.max()
        assert set(own.values) == {number}
    assert trace.malformed == trace.lost == 0


def test_a_reader_of_ros_finds_them_too(recorded: Path) -> None:
    with AnyReader([recorded], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        (connection,) = (one for one in reader.connections if one.topic == "/flock/uav1/signals")
        assert connection.msgtype == "flockwire_msgs/msg/Signals"
        _, _, raw = next(reader.messages([connection]))
        message = reader.deserialize(raw, connection.msgtype)
    assert [one.name for one in message.values] == ["V", "number"]


def test_only_the_recorder_receives_them_and_only_of_an_own_law(make_plan: Callable[..., Plan], recorded: Path) -> None:
    own, built_in = make_plan({"control.law": LAW}), make_plan()
    assert own.subscribers(Key("signals", "uav1")) == ()
    assert Key("signals", "uav1") in own.batched
    assert not [key for key in built_in.keys if key.kind == "signals"]


@pytest.mark.parametrize("value", [1, 0.5, True, np.float64(2.0)])
def test_numbers_of_every_usual_type_are_kept(value: float) -> None:
    check_decision(Decision(signals={"V": value}))


@pytest.mark.parametrize(
    ("signals", "rule"),
    [
        ({"V": float("inf")}, "signal 'V' = inf: must be a finite number"),
        ({"": 1.0}, "its name must be text"),
        ({"x" * (LONGEST_NAME + 1): 1.0}, "its name must be text"),
        ({f"s{k}": 0.0 for k in range(MOST_SIGNALS + 1)}, "must be 64 or fewer"),
    ],
)
def test_what_a_trace_cannot_keep_is_an_error_of_the_law(signals: dict[str, float], rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        check_decision(Decision(message=LeaderMotion((0.0, 0.0, 1.0)), signals=signals))


def test_the_message_survives_the_wire_and_nothing_else_does() -> None:
    message = Signals(1_790_000_000 * SECOND, "world", (("V", 0.25), ("event", 1.0)))
    data = encode(message)
    assert decode(Signals, data) == message
    for end in range(len(data)):
        with pytest.raises(MessageError):
            decode(Signals, data[:end])
    with pytest.raises(MessageError, match="not finite"):
        decode(Signals, encode(Signals(0, "world", (("V", float("nan")),))))


def test_a_laws_numbers_have_a_table_a_figure_and_a_curve_in_the_replay(recorded: Path, tmp_path: Path) -> None:
    trace = read_trace(recorded)
    table = dict(tables(trace))["signals"]
    energy = [
        value
        for drone, name, value in zip(table["drone"], table["signal"], table["value"], strict=True)
        if (drone, name) == ("uav1", "V")
    ]
    assert energy == trace.signals[1]["V"].values.tolist()
    picture = next(one for one in draw(trace, tmp_path) if one.path.stem == "signals")
    assert picture.path.exists()
    curve, own = flight_data(trace)["drones"][2]["signals"]["V"], trace.signals[2]["V"]
    assert [value for _, value in curve] == own.values.tolist()
    assert curve[0][0] == pytest.approx((own.stamps[0] - origin(trace)) / SECOND, abs=1e-3)

from __future__ import annotations

import pickle

import pytest
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.record import Record

POSE = Pose(5, "world", (1.0, 2.0, 3.0))


def test_records_are_equal_by_their_fields_and_only_within_a_kind() -> None:
    assert Pose(5, "world", (1.0, 2.0, 3.0)) == POSE
    assert hash(Pose(5, "world", (1.0, 2.0, 3.0))) == hash(POSE)
    assert Pose(6, "world", (1.0, 2.0, 3.0)) != POSE
    three = ((1.0, 0.0, 0.0),) * 3
    assert Motion(*three) != LeaderMotion(*three)
    assert POSE.fields() != POSE


def test_a_copy_differs_in_the_named_fields_only() -> None:
    assert POSE._replace(stamp=6) == Pose(6, "world", (1.0, 2.0, 3.0))
    with pytest.raises(TypeError):
        POSE._replace(colour="red")


def test_the_text_names_every_field() -> None:
    assert repr(LeaderMotion((1.0, 2.0, 3.0))) == (
        "LeaderMotion(position=(1.0, 2.0, 3.0), velocity=(0.0, 0.0, 0.0), acceleration=(0.0, 0.0, 0.0))"
    )


def every_record(kind: type[Record]) -> list[type[Record]]:
    return [one for sub in kind.__subclasses__() for one in (sub, *every_record(sub))]


@pytest.mark.sources  # compiled, a constructor checks types
@pytest.mark.parametrize("kind", every_record(Record))
def test_fields_come_in_the_order_of_the_constructor(kind: type[Record]) -> None:
    given = tuple(f"field {k}" for k in range(len(kind.__slots__)))
    assert kind(*given).fields() == given


def test_a_record_may_be_sent_to_another_process() -> None:
    assert pickle.loads(pickle.dumps(POSE)) == POSE

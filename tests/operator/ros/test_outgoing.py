"""After a pause publications leave in portions, in their order; too many are dropped and counted."""

from __future__ import annotations

from flockwire_operator.ros.mirror import MOST_WAITING, OVERHEAD, PORTION, Outgoing
from flockwire_operator.ros.topics import TF


def test_a_portion_is_bounded_and_nothing_is_lost() -> None:
    outgoing, sent = Outgoing(), [(TF, bytes([k % 256]) * 400) for k in range(1000)]
    outgoing.add(sent[:900])
    portions = [outgoing.take()]
    outgoing.add(sent[900:])
    while len(outgoing):
        portions.append(outgoing.take())
    assert [one for portion in portions for one in portion] == sent
    assert max(sum(len(data) + OVERHEAD for _, data in portion) for portion in portions) < PORTION + 400 + OVERHEAD
    assert len(portions) == 11  # of 93 each
    assert outgoing.dropped == 0


def test_a_large_one_leaves_too() -> None:
    outgoing = Outgoing()
    outgoing.add([(TF, bytes(2 * PORTION)), (TF, b"x")])
    assert [len(data) for _, data in outgoing.take()] == [2 * PORTION]
    assert outgoing.take() == [(TF, b"x")]
    assert outgoing.take() == []


def test_too_many_are_dropped_the_oldest_first() -> None:
    outgoing = Outgoing()
    outgoing.add([(TF, k.to_bytes(4, "big")) for k in range(MOST_WAITING + 3)])
    assert outgoing.dropped == 3
    assert outgoing.take()[0] == (TF, (3).to_bytes(4, "big"))

import pytest
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.runtime import publishing as module
from flockwire_core.runtime.publishing import Publishing
from flockwire_core.wire.batch import PERIOD
from flockwire_core.wire.keys import BATCH, Key

T0 = 1_700_000_000 * SECOND
BATCHED, POSE = Key(BATCH, "gateway"), Key("pose", "uav1")


@pytest.mark.sources  # replaces compiled functions
def test_a_batch_that_is_due_waits_where_its_sender_is_called_apart_from_what_is_urgent(monkeypatch, make_plan):
    now, sent = T0, []

    class Publisher:
        def __init__(self, key):
            self.key = key

        def put(self, payload, attachment):
            sent.append(self.key)

    monkeypatch.setattr(module.clock, "now", lambda: now)
    publishing = Publishing(make_plan(), "gateway", b"p" * 16, lambda key: (Publisher(key),))
    for now in (T0, T0 + PERIOD):
        publishing.publish([(POSE, Pose(now, "world", (0.0, 0.0, 1.0)))])
    assert sent == [POSE, POSE, BATCHED]

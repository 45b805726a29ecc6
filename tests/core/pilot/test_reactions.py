import pytest
from flockwire_core.pilot.reactions import BLIND, HOLD, INPUTS, LAND, REACTIONS, REFUSE, SLOW, TABLE, Reactions
from flockwire_core.swarm.tables import Limits
from flockwire_core.wire.phase import Phase

REACTIONS_OF_ONE = Reactions(Limits(), "driver1", (0,), relays=True)
CALM = dict.fromkeys(INPUTS, 0.0) | {"battery": 1.0, "woke": 60.0}


def found(phase=Phase.FORMATION, failure="", missing=(), **values):
    changed = CALM | {name.replace("_", " "): value for name, value in values.items()}
    return REACTIONS_OF_ONE.find(list(changed.values()), phase, failure, missing)


def test_nothing_is_done_while_every_input_is_within_its_limit():
    assert not any(found(phase) for phase in Phase)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.code)
def test_each_row_reacts_to_its_own_input_alone_in_its_phases(row):
    reaction = found(min(row.phases), **{row.input: 0.05 if row.below else 1e3})
    assert reaction[row.reaction].code == row.code
    assert row.reaction in REACTIONS


def test_codes_are_unique():
    assert len({row.code for row in TABLE}) == len(TABLE)


def test_the_first_row_of_a_reaction_counts():
    both = found(own_pose_lost=1.26, battery=0.05, nearby=0.2, own_pose=1.26)
    assert both[LAND].text == "own pose lost for 1.3 s"
    assert both[HOLD].text == "own pose is stale"
    assert both[REFUSE].text == "waits for its own pose"
    assert SLOW in both
    assert BLIND in both


def test_a_reason_names_what_is_missing():
    assert found(neighbour=2.0, missing=(0, 3))[REFUSE].text == "waits for the leader's pose, uav3's estimate"
    assert found(telemetry=1.1)[REFUSE].text == "waits for telemetry from driver1"
    assert found(battery=0.19)[REFUSE].text == "battery at 19%, take-off needs 20%"
    assert found(law=1.0, failure="it failed")[HOLD].text == "it failed"


def test_a_process_that_must_end_lands_after_a_second_unless_another_reason_comes_first():
    assert [found(end=1e-9).keys(), found(end=1.1).keys()] == [{REFUSE, HOLD}, {REFUSE, HOLD, LAND}]
    assert found(end=1.1, battery=0.09)[LAND].text == "battery at 9%"


def test_a_freeze_lands_a_take_off_alone():
    assert [phase for phase in Phase if LAND in found(phase, pause=1.1)] == [Phase.TAKEOFF]

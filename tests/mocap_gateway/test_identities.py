"""Names that jump from body to body, over the paths of two or three drones."""

import pytest
from flockwire.domain.time import SECOND
from flockwire_mocap.claim import Claim, in_order
from flockwire_mocap.identities import Identities

FRAME = SECOND // 100
LEVEL = (0.0, 0.0, 0.0, 1.0)


class Field:
    """Drones that fly side by side at 2 m/s; `names` is what the tracker calls the body of each."""

    def __init__(self, drones=3, spacing=0.6):
        self.identities = Identities(6.0, 0.1)
        self.frame, self.drones, self.spacing = 0, tuple(range(drones)), spacing
        self.names = {i: i for i in self.drones}

    def place(self, drone):
        return (0.02 * self.frame, self.spacing * drone, 1.0)

    def step(self, frames=1, lost=(), ghost=None):
        """Show frames without the bodies of `lost`; returns whom the last one showed where."""
        for _ in range(frames):
            self.frame += 1
            self.stamp = self.frame * FRAME
            claims = [Claim(self.stamp, self.names[i], self.place(i), LEVEL) for i in self.drones if i not in lost]
            if ghost is not None:
                claims = [c for c in claims if c.drone != ghost[0]] + [Claim(self.stamp, *ghost, LEVEL)]
            self.believed, self.held = self.identities.judge(sorted(claims, key=in_order))
            for claim in self.believed:  # whatever happens: never a false pose
                assert claim.position == self.place(claim.drone)
        return {claim.drone for claim in self.believed}

    def swap(self, a, b):
        self.names[a], self.names[b] = self.names[b], self.names[a]

    @property
    def doubted(self):
        return set(self.identities.doubts)


@pytest.fixture
def field():
    field = Field()
    field.step(20)
    return field


def test_a_usual_flight_passes_whole(field):
    assert field.step(100) == {0, 1, 2}
    assert (field.doubted, field.identities.swaps, field.identities.jumps.jumps) == (set(), 0, 0)


@pytest.mark.parametrize("frames", [6, 20, 40])
def test_a_swap_with_a_body_that_is_lost_is_seen_in_its_first_frame(field, frames):
    """The name of the lost one is on the other's body, the other name on none."""
    field.step(frames, lost=(0,))
    field.swap(0, 1)
    assert field.step(lost=(0,)) == {1, 2}
    assert field.doubted == {0, 1}
    assert field.step(100) == {0, 1, 2}


@pytest.mark.parametrize("doubted", [False, True])
def test_a_noisy_pose_is_not_that_of_a_drone_that_is_lost(field, doubted):
    """That one, unseen for long, might have flown there; for the seen one it is too far, but nobody else was nearer."""
    if doubted:
        field.swap(1, 2)
        field.step()
        field.swap(1, 2)
        field.step(5)
    field.step(30, lost=(0,))
    x, y, z = field.place(1)
    assert field.step(lost=(0,), ghost=(1, (x, y, z + 0.2))) == {2}
    assert field.step(lost=(0,)) == {1, 2}
    assert field.step() == {0, 1, 2}
    assert field.doubted == ({1, 2} if doubted else set())


@pytest.mark.parametrize(("a", "b"), [(0, 1), (1, 2), (0, 2)])
def test_a_swap_is_seen_in_its_first_frame_and_both_keep_their_own_poses(field, a, b):
    field.swap(a, b)
    assert field.step() == {0, 1, 2}
    assert field.doubted == {a, b}
    assert field.identities.doubts[a].since == field.stamp
    assert field.step(300) == {0, 1, 2}
    assert (field.doubted, field.identities.swaps) == ({a, b}, 1)


def test_names_that_are_right_again_for_a_second_are_believed(field):
    field.swap(0, 1)
    field.step(30)
    field.swap(0, 1)
    field.step(100)
    assert field.doubted == {0, 1}
    field.step(3)
    assert field.doubted == set()


def test_three_names_that_go_round_are_all_in_doubt(field):
    field.names = {0: 1, 1: 2, 2: 0}
    assert field.step() == {0, 1, 2}
    assert field.doubted == {0, 1, 2}


def test_a_name_on_the_body_of_one_that_is_lost_is_a_mistake(field):
    field.names[1] = 2  # the body of 1 is called 2, and that of 2 is not seen
    assert field.step(20, lost={2}) == {0, 1}
    assert field.doubted == {1, 2}


def test_a_swap_while_both_are_hidden_is_seen_when_they_come_back(field):
    field.step(12, lost={0, 1})
    field.swap(0, 1)
    assert field.step() == {0, 1, 2}
    assert field.doubted == {0, 1}


def test_an_occlusion_alone_is_not_a_doubt(field):
    for lost in ({0}, {0, 1}, {0, 1, 2}):
        field.step(12, lost=lost)
        assert field.step(5) == {0, 1, 2}
        assert field.doubted == set()


def test_a_jump_to_nowhere_is_held_back_and_counted(field):
    where = (field.place(1)[0], 5.0, 1.0)
    assert field.step(3, ghost=(1, where)) == {0, 2}
    assert [claim.position for claim in field.held] == [where]
    assert (field.doubted, field.identities.jumps.jumps) == (set(), 1)
    assert field.step() == {0, 1, 2}


def test_a_name_that_is_seen_on_another_drones_body_too_is_never_believed(field):
    for _ in range(20):
        x, y, z = field.place(2)
        assert field.step(ghost=(1, (x + 0.02, y + 0.01, z))) == {0, 2}
    assert field.doubted == set()


def test_after_three_seconds_without_a_body_the_next_name_counts(field):
    field.swap(0, 1)
    field.step(10)
    field.step(310, lost={0, 1})
    assert field.doubted == set()


def test_drones_that_restart_elsewhere_after_a_blackout_are_not_confused(field):
    field.frame += 60  # without any frame for a while: the simulated world was killed and restarted
    field.place = lambda drone: (0.0, field.spacing * ((drone + 1) % 3), 0.0)
    assert field.step(20) == {0, 1, 2}
    assert (field.doubted, field.identities.swaps) == (set(), 0)


@pytest.mark.parametrize("frames", [45, 60, 95])
def test_names_that_are_exchanged_in_a_blackout_are_seen_in_the_next_frame(field, frames):
    field.frame += frames
    field.swap(0, 1)
    assert field.step() == {0, 1, 2}
    assert (field.doubted, field.identities.swaps) == ({0, 1}, 1)


@pytest.mark.parametrize("frames", [45, 60, 95])
def test_drones_that_pass_by_each_other_in_a_blackout_are_not_confused(frames):
    field = Field(drones=2)
    ahead = 0.01 * (frames + 20)  # m: they are abreast in the middle of the blackout

    def passing(drone):
        return ((0.02 * field.frame, -0.2, 1.0), (2.0 * ahead - 0.02 * field.frame, 0.2, 1.0))[drone]

    field.place = passing
    field.step(20)
    field.frame += frames
    assert field.step(20) == {0, 1}
    assert field.doubted == set()


def test_a_frame_with_two_reports_of_a_name_across_the_exchange_shows_each_body_as_its_own(field):
    before = [Claim(field.stamp + FRAME // 2, 0, field.place(0), LEVEL)]
    field.swap(0, 1)
    field.frame += 1
    after = [Claim(field.frame * FRAME, field.names[i], field.place(i), LEVEL) for i in (1, 2)]
    believed, _ = field.identities.judge(sorted(before + after, key=in_order))
    assert [claim.drone for claim in believed] == [0, 1, 2]
    assert field.step() == {0, 1, 2}

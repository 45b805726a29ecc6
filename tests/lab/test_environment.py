"""The environment of PettingZoo: its contract, what it observes, and that a learned policy flies as it was trained."""

from __future__ import annotations

import pickle
import sys
from math import dist
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pettingzoo")

from flockwire.env import SwarmEnv
from flockwire_core.loading import load_swarm
from flockwire_lab.world import World
from pettingzoo.test import parallel_api_test, parallel_seed_test

LEARNED = Path(__file__).parents[2] / "laws/learned"
SWARM = LEARNED / "swarm.toml"


def env(duration=0.4, **options):
    return SwarmEnv(SWARM, lambda state, i: -state.error(i), duration, **options)


def test_the_contract_of_pettingzoo():
    parallel_api_test(env(), num_cycles=60)


@pytest.mark.long
def test_equal_seeds_give_equal_episodes():
    parallel_seed_test(lambda: env(box=(5.0, 5.0)), num_cycles=10)


def test_it_observes_what_the_law_declares_and_flies_the_actions():
    one = env(duration=2.0)
    seen, _ = one.reset(seed=1)
    names = one.names("uav3")
    assert seen["uav3"].shape == one.observation_space("uav3").shape == (len(names),)
    assert not [name for name in names if "own" in name or "velocity" in name]
    assert one.action_space("uav3").high == pytest.approx(load_swarm(SWARM).full_speed(3))
    rewards = {}
    for _ in range(100):
        seen, rewards, *_ = one.step({"uav1": (0.5, 0.0, 0.0), "uav2": (0.0, 0.0, 0.0)})
    found = dict(zip(names, seen["uav3"], strict=True))
    assert (found["in formation"], found["sees 1"]) == (1.0, 1.0)
    assert found["t"] == pytest.approx(1.0, abs=0.03)
    here = one.state_now.positions
    for axis, name in enumerate("xyz"):
        assert found[f"1: position {name}"] == pytest.approx(here[1][axis] - here[3][axis], abs=0.02)
    assert rewards["uav1"] == pytest.approx(-one.state_now.error(1))


def test_a_box_draws_other_starts_for_each_seed():
    one = env(box=(5.0, 5.0))
    starts = [(tuple(one.reset(seed=seed)[0]["uav1"]), one.state_now.positions[1]) for seed in (1, 2, 1)]
    assert starts[0] == starts[2] != starts[1]
    assert dist(starts[0][1], starts[1][1]) > 0.1  # m, more than noise


def no_reward(state, number):
    return 0.0


def test_it_can_be_sent_to_another_process():
    one = pickle.loads(pickle.dumps(SwarmEnv(SWARM, no_reward, 1.0)))
    assert len(one.names("uav3")) == one.observation_space("uav3").shape[0]
    assert one.unwrapped.render_mode is None  # SuperSuit asks for it, to fly several in processes


def test_a_law_with_messages_is_refused(tmp_path):
    law = (LEARNED / "learned.py").read_text()
    (tmp_path / "learned.py").write_text(
        law.replace("leaders=(0, 1))", "leaders=(0, 1), message=LeaderMotion)").replace("ZERO,", "ZERO, LeaderMotion,")
    )
    (tmp_path / "swarm.toml").write_text(SWARM.read_text())
    with pytest.raises(ValueError, match="sends messages"):
        SwarmEnv(tmp_path / "swarm.toml", lambda state, i: 0.0)


@pytest.mark.long
def test_a_policy_flies_as_a_law_as_it_was_trained(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(LEARNED)
    import learned

    weights = np.array([1.0, 0.8, 0.8])
    np.save(tmp_path / "learned.npy", weights)
    for file in ("learned.py", "swarm.toml"):
        (tmp_path / file).write_text((LEARNED / file).read_text())
    found = []

    def take(published):
        if published.key.kind == "truth" and published.key.owner == "uav4":
            found.append(published.sample.message().position)

    World(load_swarm(tmp_path / "swarm.toml"), 1, 6.0, tap=take).run()
    one = env(duration=2.0)
    seen, trained = one.reset(seed=1)[0], []
    while one.agents:
        seen = one.step({name: learned.policy(weights, numbers) for name, numbers in seen.items()})[0]
        trained.append(one.state_now.positions[4])
    sys.modules.pop("learned")
    begin = found.index(trained[0])
    assert len(trained) > 190
    assert found[begin : begin + len(trained)] == trained

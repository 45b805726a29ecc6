"""Learns learned.npy of learned.py by the cross-entropy method: python train.py [generations]."""

import sys
from pathlib import Path

import numpy as np
from flockwire.env import SwarmEnv
from learned import WEIGHTS, policy

POPULATION, BEST, PERIODS = 12, 3, 10  # flights of a generation, those it is drawn from next, steps with one action


def score(env, weights, seed):
    """Return the return of all drones in one episode."""
    seen, total = env.reset(seed)[0], 0.0
    while env.agents:
        seen, rewards, *_ = env.step({name: policy(weights, one) for name, one in seen.items()})
        total += sum(rewards.values())
    return total


def train(env, generations):
    """Return the mean weights of the last generation."""
    chance, mean, spread = np.random.default_rng(0), np.zeros(3), np.full(3, 1.5)
    for generation in range(generations):
        tried = chance.normal(mean, spread, (POPULATION, 3))
        scores = [score(env, weights, generation) for weights in tried]
        best = tried[np.argsort(scores)[-BEST:]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + 0.05
        print(f"generation {generation}: best return {max(scores):.1f}, weights {mean.round(2)}")
    return mean


if __name__ == "__main__":
    here = Path(__file__).with_name("swarm.toml")
    env = SwarmEnv(here, lambda state, i: -min(state.error(i), 3.0), duration=3.0, box=(5.0, 5.0))
    np.save(WEIGHTS, train(env, int(sys.argv[1]) if len(sys.argv) > 1 else 10))

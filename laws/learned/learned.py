"""A law that flies what train.py has learned: three weights of a policy that is linear, and the same for all."""

from pathlib import Path

import numpy as np
from flockwire.law import ZERO, Decision, Information, ObservedNumbers, Sense

WEIGHTS = Path(__file__).with_suffix(".npy")  # of its name: `flockwire deploy` takes it along


def policy(weights, numbers):
    """Return the command, m/s: weights of h_i', and of h_i - h_j and p_j - p_i of each in-neighbour; else rest."""
    if not numbers[0]:  # not in formation
        return np.zeros(3)
    each = numbers[9:].reshape(-1, 7)  # of an in-neighbour: h_i - h_j, whether it is seen, p_j - p_i
    return weights[0] * numbers[6:9] + weights[1] * each[:, :3].sum(axis=0) + weights[2] * each[:, 4:].sum(axis=0)


class Learned:
    information = Information(neighbours=Sense.POSITION, leaders=(0, 1))

    def __init__(self, settings):
        self.numbers = ObservedNumbers(self.information, settings.neighbours)
        self.weights = np.load(WEIGHTS) if WEIGHTS.exists() else np.zeros(3)
        self.next = ZERO

    def step(self, observation):
        command, self.next = self.next, policy(self.weights, np.array(self.numbers.of(observation)))
        return Decision(command)  # an action flies one step after its observation, as in training

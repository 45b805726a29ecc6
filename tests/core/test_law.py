"""The interface of a law, as users have it, compiled or not."""

from flockwire.law import Decision, Law, Parameters


class Gains(Parameters):
    """Parameters of a law."""

    gain: float = 2.0


class Mine(Law):
    """A law that inherits from the interface: it need not."""

    def __init__(self, settings):
        self.gain = Gains.of(settings).gain

    def step(self, observation):
        return Decision((self.gain, 0.0, 0.0))


def test_a_law_may_inherit_from_the_interface():
    assert Mine({"gain": 3.0}).step(None).command == (3.0, 0.0, 0.0)

"""A law that never returns is refused, by its method and line."""

import signal

import pytest
import tomli_w
from flockwire_core import time_limit
from flockwire_core.time_limit import ENDLESS, EndlessError, limited

LAW = """
from flockwire.law import RELAYING, Decision, LeaderMotion
{module}
class Law:
    information = RELAYING

    def __init__(self, settings):
        {making}

    def step(self, observation):
        {step}
        return Decision(message=LeaderMotion((0.0, 0.0, 1.0)))

    @staticmethod
    def check(graph, places, parameters):
        {check}
"""
LOOP = "while True: pass"
DEAF = """while True:
            try:
                while True: pass
            except Exception: pass"""


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    monkeypatch.setattr(time_limit, "LIMIT", 1.0)


@pytest.mark.parametrize(
    ("where", "loop", "line", "name"),
    [
        ("module", LOOP, "cannot import it: EndlessError: ", "<module>"),
        ("making", LOOP, "that of uav1 fails when it is made: EndlessError: ", "Law.__init__"),
        ("step", LOOP, "that of uav1 fails when it has no pose yet: EndlessError: ", "Law.step"),
        ("step", DEAF, "that of uav1 fails when it has no pose yet: EndlessError: ", "Law.step"),
        ("check", LOOP, "its check fails: EndlessError: ", "Law.check"),
    ],
)
def test_check_names_where_a_law_does_not_return(tmp_path, swarm_table, flockwire, where, loop, line, name):
    law, swarm = tmp_path / "mine.py", tmp_path / "mine.toml"
    law.write_text(LAW.format(**{"module": "", "making": "pass", "step": "pass", "check": "pass"} | {where: loop}))
    swarm.write_text(tomli_w.dumps(swarm_table({"control.law": "mine.py:Law"})))
    done = flockwire("check", swarm)
    assert done.returncode == 2
    assert f"control.law = 'mine.py:Law': {line}{ENDLESS.format(name=name, limit=1.0)} (mine.py:" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_limit_ends_with_its_context():
    before = signal.getsignal(signal.SIGALRM)
    with pytest.raises(EndlessError), limited():
        signal.pause()
    with limited():
        pass
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert signal.getsignal(signal.SIGALRM) is before

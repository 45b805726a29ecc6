"""An observer is exchanged alone: that of docs/own_law.md, with the rest of the paper's law."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from flockwire_agent.paper_law import PaperLaw
from flockwire_core.control.protocol import ProtocolParameters, control_input
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.time import SECOND
from flockwire_core.law import Heard, Observation, Place
from flockwire_core.parameters import law_settings
from flockwire_core.swarm.model import Swarm

PAGE = (Path(__file__).parents[2] / "docs" / "own_law.md").read_text(encoding="utf-8")


@pytest.fixture
def observer(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the page's module with an observer, importable as my_observer."""
    (text,) = (block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "PaperLaw(" in block)
    module = ModuleType("my_observer")
    exec(text, vars(module))
    monkeypatch.setitem(sys.modules, "my_observer", module)
    return module


def observed(estimate: LeaderMotion, swarm: Swarm) -> Observation:
    """Return what a follower knows in one step: one neighbour's estimate, its own place and position."""
    heard = [Heard(0, 1.0, True, SECOND, 1, estimate)]
    place, motion = Place(swarm.build_formation(), 0, 0), Motion((0.5, 0.0, 1.0), (0.0, 0.0, 0.0), (0.5, 0.0, 1.0))
    return Observation(1.0, 0.01, SECOND, heard=heard, place=place, now=SECOND, motion=motion)


def test_the_estimate_is_the_observers_and_the_command_that_of_the_papers_protocol(
    observer: ModuleType, make_swarm: Callable[..., Swarm]
) -> None:
    swarm = make_swarm({"observer.gain": 2.0, "control.law": "my_observer:LinearObserver"})
    settings, seen = law_settings(swarm, 1), observed(LeaderMotion((1.5, 0.0, 1.0)), swarm)
    own, papers = (law(settings).step(seen) for law in (observer.LinearObserver, PaperLaw))
    assert own.message is not None
    assert papers.message is not None
    assert own.message.position == pytest.approx((0.5 + 0.01 * 2.0 * 1.0, 0.0, 1.0))
    assert papers.message.position != pytest.approx(own.message.position)
    assert seen.motion is not None
    assert seen.place is not None
    control = swarm.control
    protocol = ProtocolParameters(control.formation_gain, control.compensation_gain, control.compensation_smoothing)
    offset, rate = seen.place.offset(1.0), seen.place.rate(1.0)
    wanted = control_input(seen.motion.position, offset, rate, own.message.position, (0.0,) * 3, protocol)
    assert own.command == pytest.approx(wanted)


def test_an_observer_may_return_an_array(make_swarm: Callable[..., Swarm]) -> None:
    settings = law_settings(make_swarm({"control.law": "paper"}), 1)
    law = PaperLaw(settings, lambda *_: np.array([1.0, 2.0, 3.0]))  # type: ignore[arg-type, return-value]
    decision = law.step(observed(LeaderMotion((1.5, 0.0, 1.0)), make_swarm()))
    assert decision.message is not None
    assert decision.message.position == (1.0, 2.0, 3.0)


def test_it_flies(observer: ModuleType, fly_flock: Callable[..., Any]) -> None:
    starts, places = [[0.0, 0.0], [1.6, 0.3], [-1.4, 0.2]], {1: [1.0, 1.0, 0.0], 2: [-1.0, 1.0, 0.0]}
    flown = fly_flock(starts, places, {"control.law": "my_observer:LinearObserver"}, 10.0)
    assert flown.failure == ""
    assert flown.closest > 0.4
    assert flown.error < 0.1

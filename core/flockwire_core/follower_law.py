"""Makes the law of a follower, and says where it failed."""

from __future__ import annotations

import re
import traceback

import flockwire_core.law
from flockwire_core.law import Law
from flockwire_core.objects import FAILURES, load_object
from flockwire_core.parameters import law_settings
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import meant

PATIENCE = 5.0  # s, of a law in another process where time waits for it
OURS = (  # files that call or import a law
    "flockwire_agent/guarded_law.py",
    "flockwire_leader/lead_messages.py",
    "importlib/__init__.py",
    "flockwire_core/wire/law_form.py",
    *(f"flockwire_core/{name}.py" for name in ("own_law", "law", "objects", "follower_law", "time_limit")),
    "flockwire_core/runtime/law_elsewhere.py",
)
MOST_FRAMES = 4  # of an error
UNEXPECTED = re.compile(r"(\w+)\.__new__\(\) got an unexpected keyword argument '(\w+)'")


class LateAnswerError(Exception):
    """A law in another process has not answered in time."""


def follower_law(swarm: Swarm, number: int, patience: float = PATIENCE) -> Law:
    """Return the law of follower `number`; one in another process has `patience` s for a step.

    Raises ConnectionError if nobody serves that one, and what a class raises.
    """
    law, settings = load_object(law_object(swarm)), law_settings(swarm, number)
    found: Law = law(settings, swarm, patience) if swarm.control.elsewhere else law(settings)
    return found


def raised(error: BaseException) -> str:
    """Return an error and its file positions, the law's first, in one line."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.endswith(OURS)]
    frames = [f for f in frames if not f.filename.startswith("<frozen")]
    places = [f"{frame.filename.rsplit('/', maxsplit=1)[-1]}:{frame.lineno}" for frame in frames[-MOST_FRAMES:]]
    text = " ".join(f"{type(error).__name__}: {error}".split())
    if (wrong := UNEXPECTED.search(text)) is not None:
        text += meant(wrong[2], getattr(getattr(flockwire_core.law, wrong[1], None), "_fields", ()))
    elif isinstance(error, AttributeError) and error.obj is not None and error.name not in (names := _names(error.obj)):
        text += meant(error.name, names)
    return text + (f" ({' > '.join(places)})" if places else "")


def _names(found: object) -> list[str]:
    try:
        return dir(found)
    except FAILURES:  # a user's object
        return []

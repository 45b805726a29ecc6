"""Where the law that `[control] law` names is found: built in, in a file, installed, in another process."""

from __future__ import annotations

from pathlib import Path

from flockwire_core.swarm.model import Swarm

OF_LAWS = (  # the files of laws/, each with a class of its name in capitals
    "consensus", "second_order", "flocking", "vasarhelyi", "bearing", "rigid", "affine", "containment", "aggregative",
    "event_triggered", "barrier", "dmpc", "orca", "sliding_mode",
)  # fmt: skip
BUILT_IN = {
    "paper": "flockwire_agent.paper_law:PaperLaw",
    "extended": "flockwire_agent.extended_law:ExtendedLaw",
    **{name: f"flockwire_laws.{name}:{name.title().replace('_', '')}" for name in OF_LAWS},
}

ELSEWHERE = "flockwire_core.runtime.law_elsewhere:LawElsewhere"  # speaks with a law in another process


def law_file(swarm: Swarm) -> Path | None:
    """Return the file of an own law, beside the swarm file; None for a built-in one or an installed module."""
    if swarm.control.law in BUILT_IN or swarm.control.elsewhere:
        return None
    module = swarm.control.law.rpartition(":")[0]
    if module.endswith(".py"):
        return Path(swarm.folder, module)
    file = Path(swarm.folder, f"{module.replace('.', '/')}.py")
    return file if swarm.folder and file.is_file() else None


def law_object(swarm: Swarm) -> str:
    """Return the class of the law, for `load_object`."""
    if swarm.control.elsewhere:
        return ELSEWHERE
    law, file = swarm.control.law, law_file(swarm)
    return BUILT_IN.get(law, law) if file is None else f"{file}:{law.rpartition(':')[2]}"

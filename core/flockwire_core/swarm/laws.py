"""Where the law that `[control] law` names is found: built in, in a file, installed, in another process."""

from __future__ import annotations

from pathlib import Path

from flockwire_core.swarm.model import Swarm

BUILT_IN = {
    "paper": "flockwire_agent.paper_law:PaperLaw",
    "extended": "flockwire_agent.extended_law:ExtendedLaw",
    "consensus": "flockwire_laws.consensus:Consensus",
    "second_order": "flockwire_laws.second_order:SecondOrder",
    "flocking": "flockwire_laws.flocking:Flocking",
    "vasarhelyi": "flockwire_laws.vasarhelyi:Vasarhelyi",
    "bearing": "flockwire_laws.bearing:Bearing",
    "rigid": "flockwire_laws.rigid:Rigid",
    "affine": "flockwire_laws.affine:Affine",
    "containment": "flockwire_laws.containment:Containment",
    "aggregative": "flockwire_laws.aggregative:Aggregative",
    "event_triggered": "flockwire_laws.event_triggered:EventTriggered",
    "barrier": "flockwire_laws.barrier:Barrier",
    "dmpc": "flockwire_laws.dmpc:Dmpc",
    "orca": "flockwire_laws.orca:Orca",
    "sliding_mode": "flockwire_laws.sliding_mode:SlidingMode",
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

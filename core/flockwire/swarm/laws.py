"""Where the law that `[control] law` names is found: built in, in a file beside the swarm file, or installed."""

from __future__ import annotations

from pathlib import Path

from flockwire.swarm.tables import Control

BUILT_IN = {
    "paper": "flockwire_agent.paper_law:PaperLaw",
    "extended": "flockwire_agent.extended_law:ExtendedLaw",
}


def law_file(control: Control) -> Path | None:
    """Return the file of an own law, beside the swarm file; None for a built-in one or an installed module."""
    module = control.law.rpartition(":")[0]
    if module.endswith(".py"):
        return Path(control.folder, module)
    file = Path(control.folder, f"{module.replace('.', '/')}.py")
    return file if control.own_law and control.folder and file.is_file() else None


def law_object(control: Control) -> str:
    """Return the class of the law, for `load_object`."""
    file = law_file(control)
    return BUILT_IN.get(control.law, control.law) if file is None else f"{file}:{control.law.rpartition(':')[2]}"

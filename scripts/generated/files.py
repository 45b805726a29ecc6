"""The generated files, by their path in the repository."""

from __future__ import annotations

import re
from pathlib import Path

from flockwire_core.loading import load_swarm
from flockwire_core.wire.plan import Plan
from flockwire_deploy.compose import compose_file

from generated.commands import commands_page
from generated.faults import faults_table
from generated.gallery import gallery_page
from generated.keys import keys_page
from generated.phases import phases_page
from generated.phases_picture import phases_picture
from generated.swarm_file import swarm_file_page

ROOT = Path(__file__).parents[2]
FLIGHT = "examples/paper_flight.toml"


def files() -> dict[str, str]:
    """Return the content of each generated file."""
    simulation, flight = (Plan(load_swarm(ROOT / name)) for name in ("examples/paper_simulation.toml", FLIGHT))
    return {
        "docs/swarm_file.md": swarm_file_page(),
        "docs/reference/commands.md": commands_page(),
        "docs/reference/keys.md": keys_page(flight, FLIGHT),
        "docs/concepts/phases.md": phases_page(),
        "docs/faults.md": with_table("docs/faults.md", faults_table()),
        "docs/gallery.md": gallery_page(),
        "docs/images/phases.svg": phases_picture(),
        "deploy/paper/compose.yaml": compose_file(simulation),
    }


def with_table(name: str, table: str) -> str:
    """Return the page `name` with `table` between the comments that enclose its generated table."""
    before, comment, rest = re.split(r"(<!-- made by [^>]*-->\n)", (ROOT / name).read_text(encoding="utf-8"))
    return f"{before}{comment}{table}{rest[rest.index('<!-- end -->') :]}"

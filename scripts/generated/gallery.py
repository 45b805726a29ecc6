"""docs/gallery.md: each law of the literature with its equation, its example and the picture of its flight."""

from __future__ import annotations

import ast
import re
from pathlib import Path

LAWS = Path(__file__).parents[2] / "laws"
HEAD = """# Gallery of laws

<!-- made by scripts/document from the laws and their examples, the pictures by scripts/gallery; change those -->

Laws of the literature, each with the flight of its example: paths from above in m, from the start (a dot) to the
end (a triangle), the graph at the end in grey, leaders in black. `law = "consensus"` flies one by name; `flockwire
check` prints what its theorem predicts. [Compare them](study.md#compare-laws), or write [your own](own_law.md).
"""


def names() -> list[str]:
    """Return the names of the laws that have an example."""
    return sorted(path.stem for path in (LAWS / "examples").glob("*.toml"))


def gallery_page() -> str:
    """Return the text of the page."""
    return HEAD + "".join(map(_section, names()))


def _section(name: str) -> str:
    module = ast.parse((LAWS / f"flockwire_laws/{name}.py").read_text(encoding="utf-8"))
    title, source, *_ = (ast.get_docstring(module) or "").split("\n\n")
    equation = re.search(r"(?:^    .*\n?|^\n(?=    ))+", ast.get_docstring(module) or "", re.MULTILINE)
    flight = [
        line.removeprefix("# ")
        for line in (LAWS / f"examples/{name}.toml").read_text(encoding="utf-8").splitlines()
        if line.startswith("# ")
    ]
    lines = (equation[0] if equation else "").strip("\n").splitlines()
    return "\n".join(
        [
            "",
            f"## {name}",
            "",
            f"{title.partition(': `law')[0]}. {' '.join(source.split()).rstrip(':.,')}.",
            "",
            "```text",
            *(line[4:] for line in lines),
            "```",
            "",
            f"![{title.partition(':')[0]}](images/laws/{name}.png)",
            "",
            f"{' '.join(flight)}",
            "",
            f"    flockwire sim laws/examples/{name}.toml",
            "",
        ]
    )

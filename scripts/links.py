"""Checks the external links of all pages: python scripts/links.py. Without the internet it says so, and succeeds.

A link fails if its server answers that the page is not there (404, 410), or if the server's name does not exist. Others
(a server that refuses programs, or is too slow) are listed as not checked.
"""

from __future__ import annotations

import http.client
import re
import socket
import sys
import urllib.error
import urllib.request
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[1]
LINK = re.compile(r"https?://[^\s<>()\"'`\]}]+(?<![.,;:])")
LOCAL = re.compile(r"https?://(?:localhost|127\.|0\.0\.0\.0|\[|10\.|192\.168\.|[A-Z]+\b)")  # of examples
GONE = (404, 410)
PATIENCE = 20.0  # s
AGENT = {"User-Agent": "Mozilla/5.0 (flockwire's link check)"}


def pages(root: Path) -> list[Path]:
    """Return the pages, and the files with links for those who cite or install."""
    found = [*root.glob("*.md"), *root.glob("docs/**/*.md"), *root.glob("examples/**/*.md"), root / "deploy/README.md"]
    return sorted([*found, root / "CITATION.cff", root / "pyproject.toml"])


def links(files: Iterable[Path]) -> dict[str, Path]:
    """Return each external link once, with the first page that has it."""
    found: dict[str, Path] = {}
    for file in files:
        for link in LINK.findall(file.read_text(encoding="utf-8")):
            if not LOCAL.match(link):
                found.setdefault(link.partition("#")[0], file)
    return found


def is_online() -> bool:
    """Return whether names of the internet can be resolved."""
    try:
        socket.getaddrinfo("github.com", 443)
    except OSError:
        return False
    return True


def problem(link: str) -> tuple[bool, str]:
    """Return whether a link is broken, and what is wrong with it (empty: nothing)."""
    try:
        with urllib.request.urlopen(urllib.request.Request(link, headers=AGENT), timeout=PATIENCE):  # noqa: S310  (https)
            return False, ""
    except urllib.error.HTTPError as error:
        return error.code in GONE, f"{error.code} {error.reason}"
    except urllib.error.URLError as error:
        return isinstance(error.reason, socket.gaierror), str(error.reason)
    except (OSError, http.client.HTTPException) as error:
        return False, str(error)


def main(found: dict[str, Path], online: Callable[[], bool] = is_online) -> int:
    """Check the links and print what is wrong; returns the exit status."""
    if not online():
        print(f"links: no internet: {len(found)} external links not checked")
        return 0
    with ThreadPoolExecutor(8) as pool:
        results = list(zip(found, pool.map(problem, found), strict=True))
    broken = [link for link, (is_broken, _) in results if is_broken]
    for link, (is_broken, wrong) in results:
        if wrong:
            print(f"links: {'BROKEN' if is_broken else 'not checked'}: {link} in {found[link].name}: {wrong}")
    print(f"links: {len(broken)} of {len(found)} external links are broken")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main(links(pages(ROOT))))

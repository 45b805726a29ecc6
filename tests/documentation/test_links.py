"""Links of the pages that the site does not build: files and headings exist, in the spelling of a repository's page."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), ROOT / "lab/RESULTS.md", *ROOT.glob("examples/**/*.md"), ROOT / "deploy/README.md"]
LINK = re.compile(r"\]\(([^)\s]+)\)")
NAMED = re.compile(r"`((?:docs|examples|lab|scripts|tests)/[\w/.]+\.\w+)`")


def anchors(page):
    """Return the anchors of a page's headings."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_to_a_file_and_a_heading(page):
    for link in LINK.findall(page.read_text(encoding="utf-8")):
        if link.startswith("https://"):
            continue
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", [*PAGES, *ROOT.glob("docs/**/*.md")], ids=lambda page: str(page.relative_to(ROOT)))
def test_every_file_that_a_page_names_exists(page):
    named = NAMED.findall(page.read_text(encoding="utf-8"))
    assert not [name for name in named if not (ROOT / name).exists()]


def test_the_files_to_edit_exist():
    page = (ROOT / "docs/concepts/architecture.md").read_text(encoding="utf-8").partition("## To change something")[2]
    named = re.findall(r"`([\w/.]+(?:/|\.\w+))`", page)
    assert not [
        name for name in named if not any((root / name).exists() for root in (ROOT, ROOT / "core/flockwire_core"))
    ]


def test_a_page_that_is_not_there_would_be_noticed():
    text = "[one](docs/none.md#there), [two](https://example.org)"
    assert LINK.findall(text) == ["docs/none.md#there", "https://example.org"]
    assert "the-ladder" in anchors(ROOT / "docs/safety.md")

"""Every `flockwire` command in the documentation exists and has the options that are written there."""

import re
from pathlib import Path

import pytest
from generated.commands import commands

ROOT = Path(__file__).parents[2]
PAGES = [
    *ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md"), ROOT / "deploy/README.md",
]  # fmt: skip
KNOWN = {one.name: set(re.findall(r"--[\w-]+", " ".join(a.name for a in one.arguments))) for one in commands()}
LINE = re.compile(r"^ *(?:\$ )?(?:\S+=\S+ )*flockwire (?!:)(.*)$")  # in a block
INLINE = re.compile(r"`(?:\.venv/bin/)?flockwire ([^`]+)`")


def written(page):
    """Yield each command of a page, from `flockwire` on."""
    text = page.read_text(encoding="utf-8")
    for line in re.findall(r"^    (.*)$", text, re.MULTILINE):
        if found := LINE.match(line):
            yield found[1].split(" #")[0]
    for block in re.findall(r"```(?:bash|text|console)\n(.*?)```", text, re.DOTALL):
        yield from (found[1].split(" #")[0] for line in block.splitlines() if (found := LINE.match(line)))
    yield from (found.replace("\n", " ") for found in INLINE.findall(text))


def mistakes(command):
    """Yield what is wrong with a command."""
    name, *rest = command.split()
    if name in ("COMMAND", "--help", "--version") or not re.fullmatch(r"[a-z][a-z-]*", name):
        return
    if name not in KNOWN:
        yield f"there is no command {name}"
        return
    for option in rest:
        if (flag := option.partition("=")[0].strip("[],.;)")).startswith("--") and flag not in KNOWN[name] | {"--help"}:
            yield f"{name} has no option {flag}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_commands_of_a_page_exist(page):
    assert not [(command, wrong) for command in written(page) for wrong in mistakes(command)]


def test_commands_are_found_and_mistakes_named():
    assert len(list(written(ROOT / "docs/flights.md"))) > 15
    assert list(mistakes("flie mine.toml")) == ["there is no command flie"]
    assert list(mistakes("up mine.toml --fast")) == ["up has no option --fast"]
    assert not list(mistakes("up mine.toml --duration 5"))

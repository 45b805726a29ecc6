"""`flockwire --help`: every command once, under its section."""

from flockwire_operator.cli.kinds import KINDS
from flockwire_operator.cli.main import SECTIONS, app
from typer.main import get_command


def test_every_command_is_in_one_section_and_processes_are_last(flockwire):
    listed = [name for names in SECTIONS.values() for name in names]
    assert sorted(listed) == sorted(get_command(app).commands)
    assert list(SECTIONS.values())[-1] == tuple(KINDS)
    lines = flockwire("--help").stdout.splitlines()
    places = [next(k for k, line in enumerate(lines) if line.startswith(f"  {name} ")) for name in listed]
    assert places == sorted(places)
    assert all(f"{title}:" in lines for title in SECTIONS)
    assert not any(lines[place].endswith("...") for place in places)  # no help is cut

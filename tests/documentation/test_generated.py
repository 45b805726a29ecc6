"""The generated pages and files are those of the code."""

import pytest
from flockwire_core.pilot.phases import transitions
from generated.files import ROOT, files
from generated.gallery import names
from generated.phases_picture import ANY, phases_picture


@pytest.fixture(scope="module")
def made():
    return files()


def test_every_generated_file_is_current(made):
    for name, text in made.items():
        assert (ROOT / name).read_text(encoding="utf-8") == text, f"{name}: run scripts/document"


def test_the_diagram_has_each_transition_to_another_phase():
    picture = phases_picture()
    for number, one in enumerate(transitions(), 1):
        arrows = any(before != one.after for before in one.before)
        drawn = f">{number}<" in picture or f">{number}, " in picture or f", {number}<" in picture
        assert drawn == arrows, number
    assert f">{ANY}<" in picture


def test_each_law_of_the_gallery_has_a_small_picture():
    pictures = {path.stem: path.stat().st_size for path in (ROOT / "docs/images/laws").glob("*.png")}
    assert sorted(pictures) == names()
    assert max(pictures.values()) < 12_000

"""One read of the answer suffices to mend a wrong file, and no library's words are in it."""

import importlib.util
from pathlib import Path

import pytest
from flockwire_core.loading import SwarmFileError, load_swarm

specification = importlib.util.spec_from_file_location("wrong_files", Path(__file__).with_name("wrong_files.py"))
wrong_files = importlib.util.module_from_spec(specification)
specification.loader.exec_module(wrong_files)

LIBRARIES = (
    "pydantic", "input should", "field required", "extra inputs", "validation", "tuple", "dict", "model", "nonetype",
    "expected ", "discriminator", "traceback",
)  # fmt: skip


def answer(tmp_path, changes):
    """Return what is said of the sound file with `changes`."""
    text = wrong_files.SOUND
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = tmp_path / "flock.toml"
    path.write_text(text)
    with pytest.raises(SwarmFileError) as refused:
        load_swarm(path)
    return [line.removeprefix(f"{path}: ") for line in str(refused.value).split("\n")]


def test_the_file_is_sound_before_it_is_changed(tmp_path):
    path = tmp_path / "flock.toml"
    path.write_text(wrong_files.SOUND)
    assert load_swarm(path).name in wrong_files.SOUND


@pytest.mark.parametrize("name", wrong_files.WRONG)
def test_each_mistake_is_answered_in_its_own_line_in_plain_words(tmp_path, name):
    changes, needed = wrong_files.WRONG[name]
    lines = answer(tmp_path, changes)
    if len(changes) > 2:
        assert len(lines) == len(needed)
        assert all(any(line.startswith(part) for line in lines) for part in needed), lines
    else:
        (line,) = lines
        assert all(part in line for part in needed), line
    assert not [word for word in LIBRARIES for line in lines if word in line.lower()]


def test_a_default_among_the_formations_is_the_formation(tmp_path):
    path = tmp_path / "flock.toml"
    path.write_text(wrong_files.SOUND)
    usual = load_swarm(path).build_formation()
    path.write_text(wrong_files.SOUND.replace("[formation]", "[formations.default]"))
    swarm = load_swarm(path)
    assert swarm.build_formation().offset(1, 3.0) == usual.offset(1, 3.0)
    assert swarm.build_formation("default").offset(1, 3.0) == usual.offset(1, 3.0)

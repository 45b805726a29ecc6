"""What hatch_build.py compiles: whole folders, with the folders in them."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from unittest.mock import MagicMock

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def hook(monkeypatch):
    """hatch_build.py, without the builder that calls it."""
    name = "hatchling.builders.hooks.plugin.interface"
    for place in range(1, len(name.split("."))):
        monkeypatch.setitem(sys.modules, ".".join(name.split(".")[:place]), ModuleType(name))
    interface = ModuleType(name)
    interface.BuildHookInterface = dict  # a class that takes a type in brackets
    monkeypatch.setitem(sys.modules, name, interface)
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_all_modules_of_a_compiled_folder_are_compiled_but_those_left_alone(hook):
    compiled = {file for entry in hook.COMPILED for file in hook._files(ROOT / entry)}
    folders = [ROOT / entry for entry in hook.COMPILED if (ROOT / entry).is_dir()]
    assert folders
    missing = {file.name for folder in folders for file in folder.rglob("*.py") if file not in compiled}
    assert missing == hook.LEFT_ALONE
    assert ROOT / "core/flockwire/control/around/way_round.py" in compiled
    assert all(file.is_file() for file in compiled)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:The distutils:DeprecationWarning")
def test_mypyc_accepts_what_is_compiled(hook, monkeypatch, tmp_path):
    """It refuses, or fails on, some Python that runs; without this, users would get interpreted code and no word."""
    core = pytest.importorskip("distutils.core")  # mypyc's, below Python 3.12; the tests have no setuptools
    for name in ("setuptools", "setuptools.command", "setuptools.command.build_ext"):
        monkeypatch.setitem(sys.modules, name, MagicMock(Extension=core.Extension))
    monkeypatch.chdir(ROOT)
    from mypyc.build import mypycify

    files = [str(file) for entry in hook.COMPILED for file in hook._files(Path(entry))]
    modules = mypycify(["--follow-imports=silent", *files], multi_file=True, target_dir=str(tmp_path))  # into C
    assert len(modules) > len(files)

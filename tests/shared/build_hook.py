"""hatch_build.py, without the builder that calls it."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from unittest.mock import patch

ROOT = Path(__file__).parents[2]
INTERFACE = "hatchling.builders.hooks.plugin.interface"


def build_hook():
    """Return the module."""
    stubs = {name: ModuleType(name) for name in (INTERFACE.rsplit(".", k)[0] for k in range(5))}
    stubs[INTERFACE].BuildHookInterface = dict  # a class that takes a type in brackets
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    module = importlib.util.module_from_spec(spec)
    with patch.dict(sys.modules, stubs):
        spec.loader.exec_module(module)
    return module


def compiled_files():
    """Return the files that are compiled."""
    hook = build_hook()
    return [file for entry in hook.COMPILED for file in hook._files(ROOT / entry)]

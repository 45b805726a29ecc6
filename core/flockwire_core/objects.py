"""Loads objects named as "package.module:name", so that their package is not imported, or as "/folder/file.py:name"."""

from __future__ import annotations

import importlib
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, Final
from zlib import crc32

FAILURES: Final = (Exception, SystemExit)  # what a user's code may raise; Ctrl-C is none of it


def load_object(path: str) -> Any:  # noqa: ANN401  (whatever it names)
    """Return the object that `path` names; raises ImportError, AttributeError, OSError, or errors of the import."""
    module, _, attribute = path.rpartition(":")
    return getattr(_of_file(Path(module)) if module.endswith(".py") else importlib.import_module(module), attribute)


def _of_file(file: Path) -> ModuleType:
    """Return the module in `file`, imported once, by a name that hides no other module; one of a package by its own.

    Its folder is searched last: what is installed cannot be replaced by a file there.
    """
    file = file.resolve()
    if (file.parent / "__init__.py").is_file():
        return _of_package(file)
    name = f"{file.stem}_{crc32(str(file).encode()):08x}"
    if name in sys.modules:
        return sys.modules[name]
    if str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))
    spec = spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} is no Python file")
    module = sys.modules[name] = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _of_package(file: Path) -> ModuleType:
    """Return the module in `file`, which is in a package: it may import others of the package."""
    folder, names = file.parent, [file.stem]
    while (folder / "__init__.py").is_file():
        folder, names = folder.parent, [folder.name, *names]
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
    module = importlib.import_module(".".join(names))
    if Path(module.__file__ or "").resolve() != file:
        raise ImportError(f"another {module.__name__} hides {file}: {module.__file__}; rename the package")
    return module

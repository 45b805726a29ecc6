"""A copy of the sources with rows added to their tables, and folders beside them; nothing else is touched."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[2]


class ExtendedSources:
    """The copy below `folder`: in `edits` (file, old, new) each old text is there once, `files` are added."""

    def __init__(self, folder: Path, edits: Iterable[tuple[str, str, str]], files: Mapping[str, str]) -> None:
        for package in (path for path in ROOT.glob("*/flockwire*") if path.is_dir()):
            shutil.copytree(package, folder / package.relative_to(ROOT))
        for name, old, new in edits:
            text = (folder / name).read_text()
            assert text.count(old) == 1, (name, old)
            (folder / name).write_text(text.replace(old, new))
        for name, text in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text)
        roots = sorted({str(path.parent) for path in folder.glob("*/flockwire*")})
        self._environment = {**os.environ, "PYTHONPATH": os.pathsep.join(roots)}

    def flockwire(self, *arguments: object, status: tuple[int, ...] = (0,)) -> str:
        """Run the copy's `flockwire`, which must end with one of `status`; return what it printed, errors too."""
        line = [sys.executable, "-m", "flockwire_operator", *map(str, arguments)]
        done = subprocess.run(line, capture_output=True, text=True, timeout=300, env=self._environment, check=False)
        assert done.returncode in status, done.stdout + done.stderr
        assert "Traceback" not in done.stderr
        return done.stdout + done.stderr

from __future__ import annotations

from pathlib import Path

import pytest
from flockwire_lab.study.workers import local
from shadows import lay_shadows


def test_workers_import_nothing_from_the_current_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    lay_shadows(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    with local(1) as workers:
        assert workers.executor.submit(abs, -2).result() == 2

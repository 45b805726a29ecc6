"""Writes every generated file."""

from __future__ import annotations

from generated.files import ROOT, files

for name, text in files().items():
    path = ROOT / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")

"""A small file that a process keeps for its next one."""

from __future__ import annotations

import logging
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


class FileStore:
    """Keeps bytes in the file `path`, without waiting for the disk. Without its folder it keeps nothing."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._writer = ThreadPoolExecutor(max_workers=1)  # starts no thread before the first write

    def read(self) -> bytes:
        """Return what was written last, empty if nothing."""
        try:
            return self._path.read_bytes()
        except OSError:
            return b""

    def write(self, data: bytes) -> None:
        """Keep `data`; does not wait for it."""
        self._writer.submit(self._write, data)

    def _write(self, data: bytes) -> None:
        new = self._path.with_suffix(".new")
        if not new.parent.is_dir():
            return
        try:
            new.write_bytes(data)
            new.replace(self._path)
        except OSError as error:
            logging.getLogger(self._path.stem).warning("%s: not kept for a restart: %s", self._path, error.strerror)

"""Keeps the flying swarm beside its file: if the file changes, orders must still reach the drones.

Every process of the flying swarm holds a shared lock on .flockwire/SWARM.flying; the last one removes it. On a file
system without locks there is no such file: who flies is not known there.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from flockwire_core import clock
from flockwire_core.locking import EXCLUSIVE, NOW, SHARED, is_held, lock, opened
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.tables import Model
from pydantic import ValidationError

from flockwire_operator.station.folders import target


class Flown(Model):
    """The flying swarm and its text, the folder of its certificates (its bytes as Latin-1), its clock's epoch, ns."""

    swarm: Swarm
    toml: str
    keys: str
    epoch: int

    @property
    def keys_folder(self) -> Path:
        """The folder of its certificates; its name need not be UTF-8."""
        return Path(os.fsdecode(self.keys.encode("latin-1")))


def flown_by(swarm: Swarm, file: Path, keys: Path) -> Flown:
    """Return the record of this process's flight: `swarm`, the current text of `file`, the certificates in `keys`."""
    toml = file.read_text(encoding="utf-8")
    return Flown(swarm=swarm, toml=toml, keys=os.fsencode(keys.resolve()).decode("latin-1"), epoch=clock.epoch())


class OtherFlightError(OSError):
    """A swarm flies by an earlier version of the file."""


def as_flown(file: Path) -> Flown | None:
    """Return the swarm that flies by `file` on this machine; None without one."""
    try:
        with opened(_place(file)) as record:
            found = Flown.model_validate_json(record.read()) if is_held(record) else None
    except (OSError, ValidationError):
        return None
    return found and found.model_copy(update={"swarm": found.swarm.beside(file)})


@contextmanager
def flown(file: Path, what: Flown) -> Iterator[None]:
    """Keep `what` beside `file` for the context, if that folder is writable.

    Raises OtherFlightError if another version flies by `file`.
    """
    record = _held(file, what)
    try:
        yield
    finally:
        if record is not None:
            if is_held(record) is False:
                _place(file).unlink(missing_ok=True)
            record.close()


def _held(file: Path, what: Flown) -> BinaryIO | None:
    place = _place(file)
    try:
        place.parent.mkdir(exist_ok=True, mode=0o700)
        record = os.fdopen(os.open(place, os.O_RDWR | os.O_CREAT, 0o600), "r+b")
    except OSError:
        return None
    for _ in range(3):  # a command that looks whether a swarm flies locks the record for a moment
        with suppress(BlockingIOError):
            if not lock(record, EXCLUSIVE | NOW):
                place.unlink(missing_ok=True)
                record.close()
                return None
            record.truncate()
            record.write(what.model_dump_json().encode())
            record.flush()
        lock(record, SHARED)
        record.seek(0)
        with suppress(ValidationError):
            if Flown.model_validate_json(record.read()).swarm.model_dump() == what.swarm.model_dump():
                return record
        record.seek(0)
    record.close()
    raise OtherFlightError(f"{file}: a swarm flies by an earlier version of it; land it first")


def _place(file: Path) -> Path:
    file = target(file)
    return file.parent / ".flockwire" / f"{file.name}.flying"

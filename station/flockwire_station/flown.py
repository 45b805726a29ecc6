"""Keeps the flying swarm beside its file: if the file changes, orders must still reach the drones.

Every process of the flying swarm holds a shared lock on .flockwire/SWARM.flying; the last one removes it.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from flockwire import clock
from flockwire.swarm.model import Swarm
from flockwire.swarm.tables import Model
from pydantic import ValidationError


class Flown(Model):
    """The flying swarm and its text, the folder of its certificates, its clock's epoch, ns."""

    swarm: Swarm
    toml: str
    keys: str
    epoch: int


def flown_by(swarm: Swarm, file: Path, keys: Path) -> Flown:
    """Return the record of this process's flight: `swarm`, the current text of `file`, the certificates in `keys`."""
    toml = file.read_text(encoding="utf-8")
    return Flown(swarm=swarm, toml=toml, keys=str(keys.resolve()), epoch=clock.epoch())


class OtherFlightError(OSError):
    """A swarm flies by an earlier version of the file."""


def as_flown(file: Path) -> Flown | None:
    """Return the swarm that flies by `file` on this machine; None without one."""
    try:
        with _place(file).open("rb") as record:
            return None if _alone(record) else Flown.model_validate_json(record.read())
    except (OSError, ValidationError):
        return None


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
            if _alone(record):
                _place(file).unlink(missing_ok=True)
            record.close()


def _held(file: Path, what: Flown) -> BinaryIO | None:
    place = _place(file)
    try:
        place.parent.mkdir(exist_ok=True, mode=0o700)
        record = os.fdopen(os.open(place, os.O_RDWR | os.O_CREAT, 0o600), "r+b")
    except OSError:
        return None
    if _alone(record):
        record.truncate()
        record.write(what.model_dump_json().encode())
        record.flush()
    fcntl.flock(record, fcntl.LOCK_SH)
    record.seek(0)
    with suppress(ValidationError):
        if Flown.model_validate_json(record.read()).swarm.model_dump() == what.swarm.model_dump():
            return record
    record.close()
    raise OtherFlightError(f"{file}: a swarm flies by an earlier version of it; land it first")


def _alone(record: BinaryIO) -> bool:
    """Lock `record` exclusively; returns whether this succeeded."""
    try:
        fcntl.flock(record, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _place(file: Path) -> Path:
    return file.parent / ".flockwire" / f"{file.name}.flying"

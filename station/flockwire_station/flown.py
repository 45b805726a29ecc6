"""The swarm as it flies, kept beside its file: the file may change, or break, and an order must still reach who flies.

Every process that flies by SWARM holds a shared lock on .flockwire/SWARM.flying beside it; the last one removes it.
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
    """What flies: the swarm as its file had it, and its text; where its certificates are; its clock's epoch, ns."""

    swarm: Swarm
    toml: str
    keys: str
    epoch: int


def flown_by(swarm: Swarm, file: Path, keys: Path) -> Flown:
    """Return what this process flies: `swarm`, as `file` has it now, with the certificates in `keys`."""
    toml = file.read_text(encoding="utf-8")
    return Flown(swarm=swarm, toml=toml, keys=str(keys.resolve()), epoch=clock.epoch())


class OtherFlightError(OSError):
    """Something flies by the file as it was before it was changed."""


def as_flown(file: Path) -> Flown | None:
    """Return what flies by `file` on this machine; None when nothing does."""
    try:
        with _place(file).open("rb") as record:
            return None if _alone(record) else Flown.model_validate_json(record.read())
    except (OSError, ValidationError):
        return None


@contextmanager
def flown(file: Path, what: Flown) -> Iterator[None]:
    """Keep `what` beside `file` meanwhile, where that can be written to.

    Raises OtherFlightError where something else flies by `file`.
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
        if Flown.model_validate_json(record.read()).swarm == what.swarm:
            return record
    record.close()
    raise OtherFlightError(f"{file}: a swarm flies by an earlier version of it; land it first")


def _alone(record: BinaryIO) -> bool:
    """Lock `record` for this process alone; returns whether nobody else holds it."""
    try:
        fcntl.flock(record, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _place(file: Path) -> Path:
    return file.parent / ".flockwire" / f"{file.name}.flying"

"""The wheels for a host without internet: names, digests and machines."""

from __future__ import annotations

import hashlib
import re
import shutil
import zipfile
from collections import Counter
from collections.abc import Iterator
from importlib.metadata import version
from importlib.resources import files
from itertools import product
from pathlib import Path
from typing import NamedTuple

from flockwire_core.swarm.wording import InputError

ARCHITECTURES = ("x86_64", "aarch64")
INSTALLER = "pip"  # one of the wheels: a system's Python may lack it
ANY = "*"  # version of Python
MAKE_THEM = "scripts/wheels ARCHITECTURE makes them"
_NAME = re.compile(
    r"(?P<name>[^-]+)-(?P<version>[^-]+)(-\d[^-]*)?-(?P<python>[^-]+)-(?P<abi>[^-]+)-(?P<platform>[^-]+)\.whl"
)


class Wheel(NamedTuple):
    """One wheel: the parts of its name, its file and its SHA-256."""

    name: str
    version: str
    pythons: frozenset[str]  # its tags, like cp311, or ANY
    architectures: frozenset[str]
    file: Path
    digest: str

    def fits(self, architecture: str, python: str) -> bool:
        """Return whether it can be installed on that machine."""
        return architecture in self.architectures and not self.pythons.isdisjoint({python, ANY})


class Wheels(NamedTuple):
    """All wheels of a folder."""

    wheels: tuple[Wheel, ...]

    @property
    def machines(self) -> tuple[str, ...]:
        """The machines with a wheel of every package: architecture and Python as x86_64/3.11, or x86_64/* for any."""
        packages = {wheel.name for wheel in self.wheels}
        bound = {tag for wheel in self.wheels for tag in wheel.pythons} - {ANY} or {ANY}
        return tuple(
            f"{arch}/{tag if tag == ANY else f'{tag[2]}.{tag[3:]}'}"
            for arch, tag in product(ARCHITECTURES, sorted(bound))
            if packages == {wheel.name for wheel in self.wheels if wheel.fits(arch, tag)}
        )

    def requirements(self) -> str:
        """Return the requirements for pip --require-hashes: each package's version and digests."""
        digests: dict[tuple[str, str], list[str]] = {}
        for wheel in self.wheels:
            if wheel.name != INSTALLER:
                digests.setdefault((wheel.name, wheel.version), []).append(f"--hash=sha256:{wheel.digest}")
        lines = (f"{name}=={version} {' '.join(sorted(held))}" for (name, version), held in sorted(digests.items()))
        return "".join(f"{line}\n" for line in lines)

    def copy(self, folder: Path) -> None:
        """Copy the wheels into `folder` and remove others."""
        folder.mkdir(parents=True, exist_ok=True)
        names = {wheel.file.name for wheel in self.wheels}
        for old in folder.glob("*.whl"):
            if old.name not in names:
                old.unlink()
        for wheel in self.wheels:
            shutil.copyfile(wheel.file, folder / wheel.file.name)

    def install(self, module: str) -> bool:
        """Return whether a wheel contains the package or file of `module`. Raises InputError."""
        top = module.partition(".")[0]
        names = (name for wheel in self.wheels for name in _archive(wheel.file).namelist())
        return any(name.partition("/")[0] in (top, f"{top}.py") for name in names)


def read_wheels(folder: Path) -> Wheels:
    """Return the wheels in `folder`; raises InputError if this flockwire cannot be installed from them."""
    found = Wheels(tuple(_wheel(file) for file in sorted(folder.glob("*.whl"))))
    for wrong in _problems(found):
        raise InputError(f"--wheels = {folder}: {wrong}; {MAKE_THEM}")
    return found


def _problems(found: Wheels) -> Iterator[str]:
    """Yield why this flockwire cannot be installed from these wheels."""
    held, mine = {(wheel.name, wheel.version) for wheel in found.wheels}, version("flockwire")
    versions = Counter(name for name, _ in held)
    yield from (f"has no wheel of {name}" for name in ("flockwire", INSTALLER) if not versions[name])
    yield from (f"has several versions of {name}; empty it" for name, count in versions.items() if count > 1)
    if ("flockwire", mine) not in held:
        yield f"its flockwire is not {mine}, the running version"
    named = (_differing(wheel.file) for wheel in found.wheels if wheel.name == "flockwire")
    yield from (f"its flockwire has other code, {name} differs" for name in named if name)
    if not found.machines:
        yield "no machine matches all of them"


def _differing(wheel: Path) -> str:
    """Return the first file in a flockwire wheel that differs from the running version, empty if there is none."""
    with _archive(wheel) as archive:
        for name in archive.namelist():
            package, _, path = name.partition("/")
            made = package.endswith(".dist-info") or name.endswith(".so")  # for the wheel alone
            if not made and archive.read(name) != _here(package, path):
                return name
    return ""


def _here(package: str, path: str) -> bytes | None:
    """Return the content of a file of an installed package, None if it has none."""
    try:
        return files(package).joinpath(path).read_bytes()
    except (OSError, ModuleNotFoundError):
        return None


def _archive(wheel: Path) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(wheel)
    except zipfile.BadZipFile:
        raise InputError(f"{wheel}: is not a valid wheel; {MAKE_THEM}") from None


def _wheel(file: Path) -> Wheel:
    parts = _NAME.fullmatch(file.name)
    if parts is None:
        raise InputError(f"{file}: does not have a wheel's name; {MAKE_THEM}")
    platform, abi = parts["platform"], parts["abi"]
    named = frozenset(arch for arch in ARCHITECTURES if arch in platform)
    bound = frozenset(parts["python"].split(".") if abi.startswith("cp") else [ANY])
    return Wheel(
        parts["name"].replace("_", "-").lower(),
        parts["version"],
        bound,
        frozenset(ARCHITECTURES) if platform == "any" else named,
        file,
        hashlib.sha256(file.read_bytes()).hexdigest(),
    )

"""Files of every target: pages from templates, the swarm file with files that it names, the needed keys."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path, PurePosixPath

from cryptography import x509
from flockwire_core.loading import framed_tables, load_table
from flockwire_core.security.credentials import common_name
from flockwire_core.security.files import in_use
from flockwire_core.security.pki import authority_name
from flockwire_core.swarm.laws import BUILT_IN, law_file
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import AUTHORITY, Plan
from jinja2 import Environment, PackageLoader, StrictUndefined, Template

Owner = tuple[int, int]  # user and group
SWARM_FILE = "swarm.toml"


def template(name: str) -> Template:
    """Return the template called `name`; a missing variable raises jinja2.UndefinedError."""
    # No browser shows it.
    pages = Environment(  # noqa: S701
        loader=PackageLoader("flockwire_deploy"), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    return pages.get_template(name)


def write_swarm(swarm: Swarm, file: Path, folder: Path, law: bool = True) -> None:
    """Copy the swarm file, the files that it names, and an own `law`, into `folder`. Raises InputError."""
    named = dict(_named(swarm, file))
    for key, name in named.items():
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts or not (file.parent / path).is_file():
            raise InputError(f"{key} = {name!r}: must lie in the swarm file's folder to be deployed with it")
    write(folder / SWARM_FILE, file.read_bytes())
    for name in named.values():
        write(folder / name, (file.parent / name).read_bytes())
    for name, held in law_files(swarm).items() if law else ():
        write(folder / name, held.read_bytes())


def law_files(swarm: Swarm) -> dict[str, Path]:
    """Return the files of an own law, by their paths from the swarm file's folder; none for one of flockwire.

    A package travels as a whole, from that folder or from where it is installed; a file with what it imports there,
    and each of these with all that has its name, as weights.
    """
    if _is_ours(swarm.control.law):
        return {}
    file = law_file(swarm)
    if file is None:
        return _installed(_package(swarm.control.law))
    file, folder = file.resolve(), Path(swarm.folder).resolve()
    if (file.parent / "__init__.py").is_file() and file.is_relative_to(folder):
        return _below(folder / file.relative_to(folder).parts[0], folder)
    return _imported(folder)


def _imported(folder: Path) -> dict[str, Path]:
    """Return the files in `folder` that this process has imported, but for those installed there, and their data."""
    files = (Path(one).resolve() for each in [*sys.modules.values()] if (one := getattr(each, "__file__", None)))
    own = [path for path in files if path.is_relative_to(folder) and "site-packages" not in path.parts]
    named = [one for path in own for one in path.parent.glob(f"{path.stem}.*") if one.is_file()]
    return {path.relative_to(folder).as_posix(): path for path in named}


def has_law(swarm: Swarm) -> bool:
    """Return whether the law is one of flockwire, or its files can be copied."""
    return _is_ours(swarm.control.law) or bool(law_files(swarm))


def _is_ours(law: str) -> bool:
    """Return whether a law is built in, or another class of a package of those."""
    return law in BUILT_IN or _package(law) in map(_package, BUILT_IN.values())


def _package(law: str) -> str:
    return law.rpartition(":")[0].partition(".")[0]


def _installed(name: str) -> dict[str, Path]:
    """Return the files of the installed package or module `name`, none if it is not installed as files."""
    spec = find_spec(name)
    origin = Path(spec.origin) if spec is not None and spec.origin is not None else None
    if origin is None or not origin.is_file():
        return {}
    return _below(origin.parent, origin.parent.parent) if origin.stem == "__init__" else {origin.name: origin}


def _below(package: Path, folder: Path) -> dict[str, Path]:
    files = (path for path in sorted(package.rglob("*")) if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to(folder).as_posix(): path for path in files}


def key_files(plan: Plan, identity: str) -> tuple[str, ...]:
    """Return the names of the key files that `identity` needs."""
    return (*(f"{name}.crt" for name in plan.authorities), f"{identity}.crt", f"{identity}.key")


def write_keys(plan: Plan, keys: Path, identities: Iterable[str], folder: Path, owner: Owner | None = None) -> None:
    """Copy the keys of `identities`, and the authorities' certificates, from `keys` into `folder`; remove others.

    They then belong to `owner`, if given and permitted. Raises InputError if one is missing.
    """
    names = sorted({name for identity in identities for name in key_files(plan, identity)})
    for name in names:
        if not (keys / name).is_file():
            raise InputError(
                f"--keys = {keys}: has no {name}; run `flockwire keys` where authority/ca.key is and copy the files"
            )
    folder.mkdir(parents=True, exist_ok=True)
    folder.chmod(0o700)
    for held in {*folder.glob("*.crt"), *folder.glob("*.key")} - {folder / name for name in names}:
        held.unlink()
    for name in names:
        shutil.copyfile(keys / name, folder / name, follow_symlinks=False)
        (folder / name).chmod(0o600)
    if owner is not None:
        for path in (folder, *folder.iterdir()):
            os.chown(path, *owner)


def remove_other_keys(folder: Path, identities: Iterable[str]) -> None:
    """Remove the folders of keys in `folder` of all identities but `identities`."""
    kept = set(identities)
    for held in folder.iterdir():
        if held.name not in kept and (held / f"{held.name}.key").exists():
            shutil.rmtree(held)


def refuse_other_keys(plan: Plan, keys: Path) -> None:
    """Raise InputError if the folder `keys` is another swarm's."""
    path = keys / f"{AUTHORITY}.crt"
    if not path.exists():
        return
    try:
        name = common_name(x509.load_pem_x509_certificate(path.read_bytes()))
    except (OSError, ValueError) as error:
        raise InputError(f"--keys = {keys}: its {path.name} cannot be read: {error}") from None
    if name != authority_name(plan.swarm.name):
        raise InputError(
            f"--keys = {keys}: are of {name!r}, this swarm is {plan.swarm.name!r}; name this swarm's, or omit --keys"
        )


def refuse_keys_in_use(keys: Path, folder: Path) -> None:
    """Raise InputError if processes of this machine run with the keys in `folder`, and those in `keys` are new.

    Keys of the same authority may be replaced.
    """
    new, old = keys / f"{AUTHORITY}.crt", folder / f"{AUTHORITY}.crt"
    if in_use(folder) and new.read_bytes() != old.read_bytes():
        raise InputError(
            f"{folder}: processes of this machine run with these keys, and those of {keys} have a new authority: no "
            "order, not even a stop, would reach them; end them first"
        )


def write(path: Path, content: str | bytes, mode: int = 0o644) -> None:
    """Write a file, and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    path.chmod(mode)


def _named(swarm: Swarm, file: Path) -> Iterator[tuple[str, str]]:
    """Yield the keys of the swarm file that name files, with the paths from its folder."""
    if (law := law_file(swarm)) is not None:
        module = swarm.control.law.rpartition(":")[0]
        yield "control.law", module if module.endswith(".py") else law.relative_to(swarm.folder).as_posix()
    for key, table in framed_tables(load_table(file)):
        yield f"{key}.file", str(table["file"])
    if swarm.gateway.source == "replay":
        yield "gateway.replay.trace", swarm.gateway.replay.trace

"""The entry of the `flockwire` command: urgent commands do not import packages of other commands.

Orders in flight and the processes of a swarm are urgent: a process is missing while it restarts. Other imports run
where an interrupt, or a lack of memory, gives one line.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import NoReturn

ORDERS = ("stop", "land", "hold")
INTERRUPTED = 130  # exit status, as shells have it
OWN_HASHES = ("_md5", "_sha1", "_sha3", *(("_sha2",) if sys.version_info >= (3, 12) else ("_sha256", "_sha512")))
OPENSSL = ("_hashlib", "_ssl", "ssl")
NO_THREAD = "can't start new thread"  # Python's text of a limit
PACKAGES = "importlib.metadata"  # what installed packages say of themselves
TIME_ZONES = (
    "/usr/share/zoneinfo",
    "/usr/lib/zoneinfo",
    "/usr/share/lib/zoneinfo",
    "/etc/zoneinfo",
)  # Python's default


def main() -> NoReturn:
    """Run the command line."""
    os.environ["MPLBACKEND"] = "agg"  # a notebook's, which its cells pass on, may not be installed here
    try:
        from flockwire_core.runtime.standard_streams import report, tolerant  # noqa: PLC0415

        with tolerant() as errors:
            status = _run()
        status = status or max((report(error) for error in errors), default=0)
    except KeyboardInterrupt:
        status = INTERRUPTED
    if status == INTERRUPTED:
        print("flockwire: interrupted", file=sys.stderr)
    raise SystemExit(status)


def print_version() -> None:
    """Print the version of the distribution."""
    from importlib.metadata import version  # noqa: PLC0415

    print(f"flockwire {version('flockwire')}")


def _run() -> int:
    """Run the command; returns its exit status."""
    try:
        _command(next(iter(sys.argv[1:]), ""))
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except (MemoryError, ImportError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and str(error) != NO_THREAD:
            raise
        last = str(error).strip().rpartition("\n")[2]  # numpy's explanation is a page long
        needed = ""
        if isinstance(error, ModuleNotFoundError):
            from flockwire_core.extras import lacking  # noqa: PLC0415

            needed = lacking(error)
        print(f"flockwire: cannot run: {needed or last or 'not enough memory'}", file=sys.stderr)
        return 1
    return 0


def spare_openssl(*names: str) -> None:
    """Import the modules `names`, which work without OpenSSL, without it: it takes 4 MB of each process.

    hashlib and hmac then have Python's own algorithms, and asyncio no TLS. Who imports ssl later gets it.
    """
    if not all(map(find_spec, OWN_HASHES)):  # this Python has no algorithms but OpenSSL's
        return
    absent = [name for name in OPENSSL if name not in sys.modules]
    sys.modules.update(dict.fromkeys(absent))  # type: ignore[arg-type]  # None: an import of it fails
    try:
        for name in names:
            import_module(name)
    finally:
        for name in absent:
            del sys.modules[name]


def spare_plugins() -> None:
    """Import pydantic without its search for plug-ins in all installed packages: it takes 2 MB of each process."""
    if PACKAGES in sys.modules:
        return
    none = ModuleType(PACKAGES)
    none.entry_points = none.distributions = lambda **_: ()  # type: ignore[attr-defined]
    sys.modules[PACKAGES] = none
    try:
        import_module("pydantic").create_model(
            "First"
        )  # the first model looks for plug-ins, later ones use what it found
    finally:
        del sys.modules[PACKAGES]


def spare_build_variables() -> None:
    """Import zoneinfo, which pydantic loads, without the variables of Python's build: they take 0.4 MB of each process.

    zoneinfo asks them for the folders of time zones alone; where the usual ones are absent, it does ask.
    """
    if "PYTHONTZPATH" in os.environ or not os.path.isdir(TIME_ZONES[0]):  # noqa: PTH112  (pathlib comes later)
        return
    os.environ["PYTHONTZPATH"] = os.pathsep.join(TIME_ZONES)
    try:
        import_module("zoneinfo")
    finally:
        del os.environ["PYTHONTZPATH"]


def _command(command: str) -> None:
    spare_openssl("hashlib", "hmac")  # which the swarm's model loads
    spare_build_variables()
    spare_plugins()
    from flockwire_core.wire.processes import PROCESSES  # noqa: PLC0415

    if any(row.started and row.kind == command for row in PROCESSES):
        spare_openssl("asyncio")  # no process uses its TLS: Zenoh has its own
        from flockwire_operator.cli.kinds import run  # noqa: PLC0415

        raise SystemExit(run(command, sys.argv[2:]))
    if command == "--version":
        print_version()
        return
    if command in ORDERS:
        from flockwire_operator.cli.orders import app  # noqa: PLC0415
    else:
        from pathlib import Path  # noqa: PLC0415

        from flockwire_operator.cli.freshness import changed_source  # noqa: PLC0415
        from flockwire_operator.cli.main import app  # noqa: PLC0415

        if line := changed_source(Path(sys.prefix)):
            print(line, file=sys.stderr)
    app(prog_name="flockwire")

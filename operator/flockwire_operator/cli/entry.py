"""The entry of the `flockwire` command: urgent commands do not import packages of other commands.

Orders in flight and the processes of a swarm are urgent: a process is missing while it restarts. Other imports run
where an interrupt, or a lack of memory, gives one line.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import NoReturn

ORDERS = ("stop", "land", "hold")
CHANGED = "flockwire: {file} has changed since it was installed in {prefix}; {script} installs it again"
NO_THREAD = "can't start new thread"  # Python's text of a limit


def main() -> NoReturn:
    """Run the command line."""
    interrupted = 130  # exit status, as shells have it
    os.environ["MPLBACKEND"] = "agg"  # a notebook's, which its cells pass on, may not be installed here
    try:
        from flockwire_core.runtime.standard_streams import report, tolerant  # noqa: PLC0415

        with tolerant() as errors:
            status = _run()
        status = status or max((report(error) for error in errors), default=0)
    except KeyboardInterrupt:
        status = interrupted
    if status == interrupted:
        print("flockwire: interrupted", file=sys.stderr)
    raise SystemExit(status)


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


def _command(command: str) -> None:
    from flockwire_core.wire.processes import PROCESSES  # noqa: PLC0415

    if any(row.started and row.kind == command for row in PROCESSES):
        from flockwire_operator.cli.kinds import run  # noqa: PLC0415

        raise SystemExit(run(command, sys.argv[2:]))
    if command == "--version":
        from importlib.metadata import version  # noqa: PLC0415

        print(f"flockwire {version('flockwire')}")
        return
    if command in ORDERS:
        from flockwire_operator.cli.orders import app  # noqa: PLC0415
    else:
        from flockwire_operator.cli.main import app  # noqa: PLC0415

        if line := changed_source(Path(sys.prefix)):
            print(line, file=sys.stderr)
    app(prog_name="flockwire")


def changed_source(prefix: Path) -> str:
    """Return a line about a source that is newer than `prefix`, if this is a clone's .venv; empty without one."""
    root = prefix.parent
    if prefix.name != ".venv":
        return ""  # developers know
    try:
        since = (prefix / "flockwire-made").stat().st_mtime
    except OSError:
        return ""  # no environment of a clone
    sources = (file for package in root.glob("*/flockwire*") for file in package.rglob("*.py"))
    changed = next((file for file in sources if file.stat().st_mtime > since), None)
    return CHANGED.format(file=changed, prefix=prefix, script=root / "scripts/fly") if changed else ""

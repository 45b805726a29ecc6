"""A container's health check, `python -P -m flockwire_operator.cli.health`: asks the process.

It imports nothing of the project, because the engine runs it repeatedly during flights.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import tempfile

PATIENCE = 2.0  # s for an answer


def ask(path: str) -> tuple[bool, str]:
    """Return whether the process at the Unix socket `path` is healthy, and a line about it."""
    oldest_step = 2.0  # s
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asker:
        asker.settimeout(PATIENCE)
        asker.bind(os.path.join(folder, "asker"))  # noqa: PTH118  (pathlib takes longer to import than all the rest)
        try:
            asker.sendto(b"?", path)
            told = json.loads(asker.recv(4096))
        except TimeoutError:
            return False, f"no answer within {PATIENCE:g} s: its loop is frozen"
        except OSError as error:
            return False, f"{path}: no process answers: {error.strerror}"
    age = told["step_age_s"]
    line = f"{told['identity']}: {told['phase']} {told['detail']}".rstrip()
    if age is None or age > oldest_step:
        return False, f"{line}; {'no step yet' if age is None else f'last step {age:.1f} s ago'}"
    return True, line


def main(path: str) -> int:
    """Print the state of the process; return 0 if it is healthy, else 1."""
    well, line = ask(path)
    print(line)
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main(os.environ["FLOCKWIRE_HEALTH"]))

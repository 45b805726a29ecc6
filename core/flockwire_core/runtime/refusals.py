"""Counts the connections that this process refused.

Zenoh reports a failed handshake only in its log on the standard output. So a pipe reads the standard output: refusals
are counted and logged once for each reason, all other lines go to the standard error.
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import sys
from collections import Counter

import zenoh

from flockwire_core.swarm.wording import printable

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_REFUSAL = re.compile(r"WARN .*zenoh_link_tls::\w+: (?P<reason>.*)")
_NOISE = re.compile(r"(: verification time| Hint:).*")  # differs from one refusal to the next, or misleads
LOG_VARIABLE = "RUST_LOG"  # of Rust's programs: a user's filter for them must not hide refusals
LOG_FILTER = "zenoh_link_tls=warn"


class Refusals:
    """Watches the log of this process's Zenoh; nothing else may write to the standard output afterwards."""

    def __init__(self, identity: str) -> None:
        self.reasons: Counter[str] = Counter()
        self._log = logging.getLogger(identity)
        self._rest = b""

    def watch(self) -> None:
        """Start, in the running loop, before a session opens."""
        read_end, write_end = os.pipe()
        os.set_blocking(write_end, False)  # a full pipe loses a line of log, and never blocks Zenoh
        os.dup2(write_end, sys.stdout.fileno())
        os.close(write_end)
        os.set_blocking(read_end, False)
        os.environ[LOG_VARIABLE] = f"{os.environ.get(LOG_VARIABLE) or 'off'},{LOG_FILTER}"
        zenoh.init_log_from_env_or(LOG_FILTER)
        asyncio.get_running_loop().add_reader(read_end, self._readable, read_end)

    @property
    def count(self) -> int:
        """The number of refused connections."""
        return self.reasons.total()

    def _readable(self, read_end: int) -> None:
        *lines, rest = (self._rest + os.read(read_end, 65536)).split(b"\n")
        self._rest = rest[-4096:]  # of a line without end
        for line in lines:
            self.take(line.decode(errors="replace"))

    def take(self, line: str) -> None:
        """Count one line of the log if it reports a refusal, else pass it on."""
        plain = _COLOUR.sub("", line)
        refusal = _REFUSAL.search(plain)
        if refusal is None:
            print(printable(plain), file=sys.stderr)
            return
        reason = _NOISE.sub("", refusal["reason"]).rstrip(".")
        if reason not in self.reasons and len(self.reasons) >= 32:  # named reasons
            reason = "other reasons"
        self.reasons[reason] += 1
        if self.reasons[reason] == 1:
            self._log.warning("refused a connection: %s (logged once, counted in status)", reason)

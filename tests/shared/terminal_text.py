"""What a terminal shows: its other end gets what is written to it in parts, whenever the kernel passes them on."""

import os
from select import select


def text_until(terminal: int, last: str) -> str:
    """Read `terminal` until `last` has come, and return all."""
    text = b""
    while last.encode() not in text:
        readable, _, _ = select([terminal], [], [], 10)
        assert readable, text
        text += os.read(terminal, 65536)
    return text.decode()

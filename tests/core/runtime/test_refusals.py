import logging
import os
import socket
import subprocess
import sys

import pytest
import tomli_w
from flockwire_core.runtime.refusals import Refusals

DIM, OFF, YELLOW, RED = "\x1b[2m", "\x1b[0m", "\x1b[33m", "\x1b[31m"


def line(reason, level=f"{YELLOW} WARN{OFF}", module="zenoh_link_tls::unicast"):
    """Return a line as Zenoh logs it, colours and all."""
    time = f"{DIM}2026-11-21T08:57:07.147758Z{OFF}"
    return f"{time} {level} app-0 ThreadId(02) {DIM}{module}{OFF}{DIM}:{OFF} {reason}"


UNKNOWN = line("invalid peer certificate: UnknownIssuer. Hint: increase the system open file limit.")


def expired(second):
    return line(
        f"invalid peer certificate: certificate expired: verification time {second} (UNIX), but certificate is not "
        "valid after 1794646630 (604800 seconds ago). Hint: increase the system open file limit."
    )


@pytest.fixture
def refusals():
    return Refusals("uav1")


def test_at_first_nothing_was_refused(refusals):
    assert refusals.count == 0


def test_a_refusal_is_counted_by_its_reason(refusals, capsys):
    refusals.take(UNKNOWN)
    assert refusals.reasons == {"invalid peer certificate: UnknownIssuer": 1}
    assert refusals.count == 1
    assert capsys.readouterr() == ("", "")


def test_a_line_without_colours_is_understood_too(refusals):
    refusals.take("2026-11-21T08:57:07Z  WARN app-0 ThreadId(02) zenoh_link_tls::unicast: peer sent no certificates.")
    assert refusals.reasons == {"peer sent no certificates": 1}


def test_what_differs_from_one_refusal_to_the_next_makes_no_new_reason(refusals):
    for second in range(1_795_251_430, 1_795_251_450):
        refusals.take(expired(second))
    assert refusals.reasons == {"invalid peer certificate: certificate expired": 20}


def test_all_reasons_count(refusals):
    for told in (UNKNOWN, expired(1), UNKNOWN, line("peer sent no certificates")):
        refusals.take(told)
    assert refusals.count == 4
    assert len(refusals.reasons) == 3


def test_each_reason_is_logged_once(refusals, caplog):
    with caplog.at_level(logging.WARNING, logger="uav1"):
        for told in (UNKNOWN, expired(1), UNKNOWN, expired(2), UNKNOWN):
            refusals.take(told)
    assert [record.getMessage() for record in caplog.records] == [
        "refused a connection: invalid peer certificate: UnknownIssuer (logged once, counted in status)",
        "refused a connection: invalid peer certificate: certificate expired (logged once, counted in status)",
    ]


@pytest.mark.parametrize(
    "other",
    [
        line("something went wrong", level=f"{RED}ERROR{OFF}"),
        line("link is slow", module="zenoh_transport::unicast"),
        "thread 'app-0' panicked at src/lib.rs:1:1:",
        "",
    ],
)
def test_all_else_is_passed_on_without_colours(refusals, capsys, other):
    refusals.take(other)
    assert refusals.count == 0
    out, err = capsys.readouterr()
    assert out == ""
    assert "\x1b" not in err
    assert err.rstrip("\n").endswith(other.rpartition(" ")[2])


WATCH = """
import asyncio, os, sys
from flockwire_core.runtime.refusals import Refusals

async def main():
    refusals = Refusals("uav1")
    refusals.watch()
    text = sys.stdin.buffer.read()
    for k in range(0, len(text), 37):
        os.write(1, text[k:k + 37])
        await asyncio.sleep(0)
    deadline = asyncio.get_running_loop().time() + 10.0
    while refusals.count < 3 and asyncio.get_running_loop().time() < deadline:
        await asyncio.sleep(0.001)
    for _ in range(20):  # rounds of the loop, in which the rest of what is in the pipe is read
        await asyncio.sleep(0)
    print(dict(refusals.reasons), file=sys.stderr)

asyncio.run(main())
"""


def test_the_log_is_read_from_the_standard_output_however_it_is_cut_up():
    text = "\n".join([UNKNOWN, expired(1), "a panic \u00fc", ""]).encode() + b"\xff\xfe\n"
    text += f"{expired(2)}\nhalf a line".encode()
    done = subprocess.run([sys.executable, "-c", WATCH], input=text, capture_output=True, timeout=30, check=True)
    assert done.stdout == b""
    told = done.stderr.decode()
    assert "{'invalid peer certificate: UnknownIssuer': 1, 'invalid peer certificate: certificate expired': 2}" in told
    assert "a panic \u00fc\n" in told
    assert "\ufffd\ufffd\n" in told
    assert "half a line" not in told


FLOOD = """
import asyncio, os, sys
from flockwire_core.runtime.refusals import Refusals

async def main():
    Refusals("uav1").watch()
    dropped = 0
    for _ in range(100):
        try:
            os.write(1, b"x" * 4096)
        except BlockingIOError:
            dropped += 1
    print(dropped, file=sys.stderr)

asyncio.run(main())
"""


def test_a_flood_of_refusals_never_blocks_the_one_who_logs():
    done = subprocess.run([sys.executable, "-c", FLOOD], timeout=2, check=True, stderr=subprocess.PIPE)
    assert 0 < int(done.stderr) < 100  # nobody read meanwhile


REFUSE = """
import asyncio, json, socket, sys
from pathlib import Path
from flockwire_core.runtime.configuration import configuration
from flockwire_core.runtime.refusals import Refusals
from flockwire_core.security.files import files_of
from flockwire_core.loading import read_swarm
from flockwire_core.wire.plan import Plan
import zenoh

class Watching(Refusals):
    def take(self, line):
        super().take(line)
        if self.count:
            refused.set()

async def main():
    file, keys, port = sys.argv[1:]
    plan = Plan(read_swarm(Path(file)))
    refusals = Watching("gateway")
    refusals.watch()
    config = configuration(plan, "gateway", files_of(Path(keys), "gateway"))
    config["listen"]["endpoints"], config["connect"]["endpoints"] = [f"tls/127.0.0.1:{port}"], []
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config))):
        with socket.create_connection(("127.0.0.1", int(port))) as stranger:
            stranger.sendall(b"no handshake")
            await refused.wait()

refused = asyncio.Event()
asyncio.run(main())
"""


@pytest.mark.parametrize("shell", ["", "error", "off", "zenoh=error"])
def test_a_filter_of_the_users_shell_hides_no_refusal(keys, make_plan, swarm_table, tmp_path, shell):
    file = tmp_path / "swarm.toml"
    file.write_text(tomli_w.dumps(swarm_table({})))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-c", REFUSE, str(file), str(keys), str(port)]
    subprocess.run(command, env=os.environ | {"RUST_LOG": shell}, timeout=30, check=True)

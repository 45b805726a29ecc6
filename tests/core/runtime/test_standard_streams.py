"""Standard output that is full, gone or stands still: one line, a right exit status, and nobody waits for it."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from flockwire_core.runtime.standard_streams import DROPPED, MOST, UnblockedStream, busy, later, unblocked

FULL = Path("/dev/full")


def flockwire(*arguments, stdout=subprocess.PIPE, stand_in="", folder=None):
    """Call the command; `stand_in` is the text of a module that it imports instead of pydantic."""
    environment = dict(os.environ)
    if stand_in:
        (folder / "pydantic.py").write_text(stand_in)
        environment["PYTHONPATH"] = str(folder)
    line = [sys.executable, "-m", "flockwire_operator", *map(str, arguments)]
    done = subprocess.run(
        line, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=60, check=False, env=environment
    )
    return done.returncode, done.stderr


@pytest.mark.parametrize("arguments", [("init", "--help"), ("--version",)])
def test_a_full_disk_is_one_line_and_a_failure(arguments):
    with FULL.open("w") as full:
        assert flockwire(*arguments, stdout=full) == (
            1,
            "flockwire: the standard output could not be written: No space left on device\n",
        )


def test_a_reader_that_has_left_is_one_line_and_not_a_failure():
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "w") as gone:
        assert flockwire("--version", stdout=gone) == (
            0,
            "flockwire: the standard output could not be written: Broken pipe\n",
        )


def test_a_failure_keeps_its_exit_status_and_its_line_without_an_output(tmp_path):
    with FULL.open("w") as full:
        status, said = flockwire("check", tmp_path / "none.toml", stdout=full)
    assert status == 2
    assert said.startswith(f"flockwire: {tmp_path}/none.toml: cannot read the swarm file")


@pytest.mark.parametrize(
    ("raised", "status", "line"),
    [
        ("KeyboardInterrupt", 130, "interrupted"),
        ("MemoryError", 1, "cannot run: not enough memory"),
        ("ImportError('much\\n\\nlib.so: failed to map segment\\n')", 1, "cannot run: lib.so: failed to map segment"),
        ('RuntimeError("can\'t start new thread")', 1, "cannot run: can't start new thread"),
    ],
)
@pytest.mark.parametrize("command", ["check", "land", "agent"])
def test_an_import_that_is_interrupted_or_lacks_memory_is_one_line(command, raised, status, line, tmp_path):
    assert flockwire(command, stand_in=f"raise {raised}", folder=tmp_path) == (status, f"flockwire: {line}\n")


def test_another_error_keeps_its_traceback_whatever_its_text(tmp_path):
    status, said = flockwire("check", stand_in="raise RuntimeError('no thread of the argument')", folder=tmp_path)
    assert status == 1
    assert said.startswith("Traceback")


def test_while_a_swarm_flies_no_process_waits_for_a_reader_and_nothing_is_lost():
    read_end, write_end = os.pipe()
    found, data = [], 300 * b"0123456789" * 100  # more than a pipe holds
    reader = threading.Thread(target=lambda: found.append(_all(read_end)))
    with unblocked():
        outlet = UnblockedStream(write_end)
        assert outlet.write(data) == len(data)
        later(lambda: outlet.write(b"end"))
        assert busy()
        reader.start()
    assert not busy()
    os.close(write_end)
    reader.join()
    assert found == [data + b"end"]


def test_of_a_paused_reader_the_lines_that_no_longer_fit_are_dropped_and_counted():
    read_end, write_end = os.pipe()
    found, full, kept = [], 1_000_000 * b"x", b"line\n" * (MOST - 1)
    reader = threading.Thread(target=lambda: found.append(_all(read_end)))
    outlet = UnblockedStream(write_end)
    with unblocked():
        outlet.write(full)  # more than a pipe holds
        for _ in range(MOST + 6):
            outlet.write(b"line\n")
        reader.start()
    with unblocked():
        outlet.write(b"later\n")
    os.close(write_end)
    reader.join()
    assert found == [full + kept + DROPPED.format(count=7).encode() + b"later\n"]


def test_the_end_of_a_process_does_not_wait_for_a_paused_reader():
    read_end, write_end = os.pipe()
    outlet = UnblockedStream(write_end)
    with unblocked(patience=0.0):
        outlet.write(1_000_000 * b"x")
        assert busy()
    os.close(read_end)  # the thread ends


@pytest.mark.parametrize(("unbuffered", "written"), [("1", ("out\n", "err\n")), ("", ("", "err\n"))])
def test_a_line_is_written_when_python_would_write_it(unbuffered, written):
    script = (
        "import os, sys\nfrom flockwire_core.runtime.standard_streams import tolerant\n"
        "with tolerant():\n    print('out')\n    print('err', file=sys.stderr)\n    os._exit(0)"
    )
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    line = [sys.executable, "-c", script]
    done = subprocess.run(line, capture_output=True, text=True, timeout=60, check=True, env=environment)
    assert (done.stdout, done.stderr) == written


def test_a_table_that_cannot_be_drawn_is_reported_and_what_follows_is_written(capsys):
    read_end, write_end = os.pipe()
    with unblocked():
        later(lambda: 1 / 0)
        UnblockedStream(write_end).write(b"next")
    os.close(write_end)
    assert _all(read_end) == b"next"
    assert "ZeroDivisionError" in capsys.readouterr().err


def _all(fd):
    with os.fdopen(fd, "rb") as source:
        return source.read()

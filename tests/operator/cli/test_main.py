"""The exit status, as a user's script sees it."""

import os
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import pytest
from command_line import interpreter, refused
from flockwire_core.runtime.session import EndpointInUseError
from flockwire_core.swarm.reading import NO_FILE
from ports import free_ports

PAPER = Path(__file__).parents[3] / "examples" / "paper_simulation.toml"


@pytest.fixture
def broken(tmp_path):
    """Return the builder of the paper's swarm file with one line replaced."""

    def build(old, new):
        text = PAPER.read_text()
        assert old in text
        path = tmp_path / "broken.toml"
        path.write_text(text.replace(old, new))
        return path

    return build


@pytest.fixture
def moved(broken):
    """Return the builder of the paper's swarm file at free ports."""
    return lambda: broken("[control]", f"[network]\nbase_port = {free_ports()}\n[control]")


def test_a_sound_swarm_is_described_and_all_is_well_in_an_interpreter_of_its_own():
    done = interpreter("check", PAPER)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("swarm paper: 4 followers")


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("rate_hz = 100", "rate_hz = '100'", "control.rate_hz = '100': must be a whole number from 10 to 500"),
        (
            "[2, 3]",
            "[4, 3]",
            "graph.edges: no spanning tree from a leader: none reaches uav3, uav4; add edges [from, to]",
        ),
        ("speed = 3.0", "sped = 3.0", "limits.sped = 3.0: unknown key; did you mean limits.speed?"),
    ],
)
def test_a_bad_swarm_file_is_refused_in_one_line(flockwire, broken, old, new, line):
    path = broken(old, new)
    assert refused(flockwire("check", path)) == f"flockwire: {path}: {line}"


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("check", "nowhere.toml"), "flockwire: nowhere.toml: cannot read the swarm file: No such file or directory"),
        (("agent", PAPER, 9), "flockwire: ID = 9: must be one of [1, 2, 3, 4]"),
        (("router", PAPER), "flockwire: paper has no router: only a swarm with network.mode = 'router' has one"),
        (("start", PAPER, "--formation", "x"), "flockwire: --formation = 'x': the swarm file has no [formations]"),
        (("up", PAPER, "--host", "mars"), "flockwire: --host = 'mars': must be one of ['local'] ([hosts])"),
        (("report", "nowhere.mcap"), "flockwire: nowhere.mcap: No such file or directory"),
        (("recover", "nowhere.mcap"), "flockwire: nowhere.mcap: No such file or directory"),
        (("view", PAPER.parent), f"flockwire: {PAPER.parent}: Is a directory"),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_a_bad_argument_is_refused_in_one_line(flockwire, arguments, line):
    assert refused(flockwire(*arguments)).startswith(line)


def refused_usage(done):
    """Return what is said about a command line that is wrong."""
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    return done.stderr


@pytest.mark.parametrize("arguments", [("fly",), ("check",), ("agent", PAPER, "x"), ("up", PAPER, "--duration", "-1")])
def test_bad_usage_is_status_two_without_a_traceback(flockwire, arguments):
    assert refused_usage(flockwire(*arguments))


def test_a_trace_of_another_flight_is_never_written_over(flockwire, tmp_path):
    (tmp_path / "trace.mcap").touch()
    for process in ("up", "recorder"):
        assert "there is a trace of another flight" in refused(flockwire(process, PAPER, "--out", tmp_path))


def refused_after_warnings(done):
    """Return the line that refuses a command which has printed what it expects of the flight."""
    assert done.returncode == 2
    assert all(line.startswith("flockwire: warning: ") for line in done.stdout.splitlines())
    (line,) = done.stderr.splitlines()
    return line


@pytest.mark.parametrize(("command", "number"), [("up", ()), ("probe", ()), ("identify", (1,))])
def test_a_folder_that_cannot_be_written_is_refused_in_one_line(flockwire, moved, tmp_path, command, number):
    path, out = moved(), tmp_path / "file"
    out.touch()
    line = refused_after_warnings(flockwire(command, path, *number, "--out", out, "--keys", tmp_path / "keys"))
    assert line.startswith(f"flockwire: --out = {out}: cannot write there: ")


def test_two_flights_are_not_compared_into_a_file(flockwire, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    for function in ("reading.read_trace", "summary.summarise", "comparison.comparison"):
        monkeypatch.setattr(f"flockwire_analysis.{function}", lambda _: SimpleNamespace(lost_bytes=0))
    monkeypatch.setattr("flockwire_analysis.comparison.as_text", lambda *_: ["figures"])
    done = flockwire("compare", "a.mcap", "b.mcap", "--out", tmp_path / "file")
    assert (done.returncode, done.stdout) == (2, "figures\n")
    assert done.stderr == f"flockwire: --out = {tmp_path / 'file'}: cannot write there: File exists\n"


@pytest.mark.parametrize("command", ["up", "sim"])
def test_a_folder_that_cannot_be_looked_at_is_refused_in_one_line(flockwire, moved, tmp_path, command):
    keys = ("--keys", tmp_path / "keys") if command == "up" else ()
    line = refused_after_warnings(flockwire(command, moved(), "--out", 300 * "x", *keys))
    assert "x: cannot write there: File name too long" in line


def test_an_endpoint_in_use_is_no_folder_that_cannot_be_written(flockwire, tmp_path, monkeypatch):
    async def fly(*_):
        raise EndpointInUseError("operator cannot listen at 127.0.0.1:7447")

    monkeypatch.setattr("flockwire_operator.station.conduct.fly", fly)
    line = refused_after_warnings(flockwire("up", PAPER, "--out", tmp_path / "out", "--keys", tmp_path / "keys"))
    assert line == "flockwire: operator cannot listen at 127.0.0.1:7447"


def test_a_flight_of_endless_duration_is_refused_before_anything_starts(flockwire, moved, tmp_path):
    done = flockwire("up", moved(), "--duration", "inf", "--headless", "--out", tmp_path / "out")
    assert "--duration" in refused_usage(done)
    assert not (tmp_path / "out").exists()


def test_virtual_flights_of_endless_duration_are_refused(flockwire, tmp_path):
    compared = ("compare-laws", PAPER, "consensus", "--out", tmp_path / "out")
    for command in (("sim", PAPER), compared, ("check", PAPER), ("study", PAPER, "--replay", PAPER)):
        assert "must be a finite number of seconds" in refused_usage(flockwire(*command, "--duration", "inf"))


def test_who_reads_half_a_trace_is_told(flockwire, tmp_path):
    whole = tmp_path / "whole"
    assert flockwire("sim", PAPER, "--duration", "2", "--out", whole).returncode in (0, 1)
    data, half = (whole / "trace.mcap").read_bytes(), tmp_path / "half.mcap"
    half.write_bytes(data[: len(data) * 2 // 3])
    for command in (("export",), ("view",), ("compare", whole, "--out", tmp_path / "compared")):
        done = flockwire(*command, half)
        assert done.returncode == 0
        assert "bytes of" in done.stderr
        assert "are incomplete" in done.stderr


@pytest.mark.parametrize("command", [(), ("check",), ("land",), ("agent",)])
def test_h_helps_everywhere(flockwire, command):
    done = flockwire(*command, "-h")
    assert (done.returncode, done.stderr) == (0, "")
    assert "Usage: flockwire" in done.stdout


def test_the_version_is_that_of_the_distribution(flockwire):
    assert flockwire("--version").stdout == f"flockwire {version('flockwire')}\n"


def test_keys_lie_beside_the_swarm_file_whatever_the_working_directory(flockwire, broken, tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert flockwire("keys", broken("speed = 3.0", "speed = 3.5")).returncode == 0
    assert (tmp_path / ".flockwire" / "paper" / "keys" / "ca.crt").exists()
    assert not list((tmp_path / "elsewhere").iterdir())


@pytest.mark.parametrize("command", ["check", "stop"])
def test_a_pipe_is_refused_and_not_waited_for(tmp_path, command):
    path = tmp_path / "pipe.toml"
    os.mkfifo(path)
    assert refused(interpreter(command, path)) == f"flockwire: {path}: cannot read the swarm file: {NO_FILE}"


def test_a_name_with_control_characters_is_printed_without_them(flockwire, tmp_path):
    line = refused(flockwire("check", tmp_path / "a\x1b[31m.toml"))
    assert line == f"flockwire: {tmp_path}/a\\x1b[31m.toml: cannot read the swarm file: No such file or directory"

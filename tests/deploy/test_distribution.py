"""The source distribution, and its wheel: installed in an environment of its own, the wheel flies a swarm."""

import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from shadows import lay_shadows

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
UV = shutil.which("uv") or str(ROOT / ".uv/bin/uv")


NO_NETWORK = ("unshare", "--net", "--map-root-user", "sh", "-c", 'ip link set lo up && exec "$@"', "sh")


def has_namespaces():
    """Return whether this machine may run a program without a network."""
    try:
        return subprocess.run([*NO_NETWORK, "true"], capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


def run(*line, **options):
    """Run a program to its end; returns what it printed."""
    done = subprocess.run(list(map(str, line)), capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, (line, done.stdout, done.stderr)
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return the folder with both; the wheel is made from the source distribution."""
    out = tmp_path_factory.mktemp("dist")
    run(UV, "build", "--quiet", "--out-dir", out, cwd=ROOT)
    return out


def test_the_source_distribution_has_what_a_developer_needs(built):
    (file,) = built.glob("*.tar.gz")
    with tarfile.open(file) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    for needed in (
        "README.md",
        "uv.lock",
        "CITATION.cff",
        "scripts/test",
        "docs/index.md",
        "examples/paper/swarm.toml",
    ):
        assert needed in names


def test_the_wheel_has_the_code_alone(built):
    (file,) = built.glob("*.whl")
    with zipfile.ZipFile(file) as archive:
        names = archive.namelist()
    assert "flockwire_core/pilot/transitions.csv" in names
    assert all(name.startswith("flockwire") for name in names)


@pytest.fixture(scope="module")
def program(built, tmp_path_factory):
    """Return the folder of the programs of an environment that has the wheel."""
    (wheel,) = built.glob("*.whl")
    folder = tmp_path_factory.mktemp("installed") / "env"
    run(sys.executable, "-m", "venv", folder)
    run(folder / "bin/python", "-m", "pip", "install", "--quiet", f"{wheel}[station,report]")
    return folder / "bin"


@pytest.fixture
def here(tmp_path):
    """Return a folder of a user with files that are called as modules of Python are."""
    lay_shadows(tmp_path)
    return tmp_path


def test_an_environment_of_its_own_flies(program, here):
    where = run(program / "python", "-P", "-c", "import flockwire; print(flockwire.__path__[0])", cwd=here)
    assert where.startswith(str(program.parent))
    run(program / "flockwire", "init", "mine.toml", cwd=here)
    run(program / "flockwire", "check", "mine.toml", cwd=here)
    out = run(program / "flockwire", "sim", "mine.toml", "--duration", 12, "--out", "flight", cwd=here)
    assert out.endswith("flockwire: all well\n")
    assert (here / "flight/report.html").exists()
    run(program / "flockwire", "animate", "flight/trace.mcap", "--seconds", 2, cwd=here)


def test_the_four_commands_of_the_page_draw_the_first_figure_of_an_own_law(program, here):
    page = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    block = page.partition("From nothing to the first figure")[2]
    commands = [
        line.split("#")[0].split()
        for line in re.findall(r"^    (.*)$", block.partition("\nThe wheel")[0], re.MULTILINE)
    ]
    assert [command[0] for command in commands] == ["python3", "lab/bin/pip", "lab/bin/flockwire", "lab/bin/flockwire"]
    for command in commands[2:]:
        run(program / "flockwire", *command[1:], cwd=here)
    assert (here / "first/trajectories.png").exists()


@pytest.mark.alone
@pytest.mark.skipif(not has_namespaces(), reason="a program cannot be run without a network here")
def test_it_flies_real_processes_in_one_command_without_a_network(program, here):
    run(program / "flockwire", "init", "mine.toml", cwd=here)
    line = (program / "flockwire", "up", "mine.toml", "--headless", "--duration", 8, "--out", "flight")
    assert run(*NO_NETWORK, *line, cwd=here).endswith("flockwire: all well\n")
    assert (here / "flight/replay.html").exists()
    run(program / "flockwire", "report", "flight/trace.mcap", "--out", "again", cwd=here)
    assert (here / "again/report.html").exists()

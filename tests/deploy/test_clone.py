"""A fresh clone, as users have one: its environments, whatever their shell and their current folder contain."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from shadows import lay_shadows

pytestmark = [pytest.mark.long, pytest.mark.sources, pytest.mark.alone]
ROOT = Path(__file__).parents[2]
SOMEWHERE = ("PIP_TARGET", "PIP_PREFIX", "PYTHONHOME", "VIRTUAL_ENV", "UV_PROJECT_ENVIRONMENT", "UV_PROJECT")
OTHERS = dict.fromkeys(SOMEWHERE, "/nowhere") | {  # what shells of users contain
    "PIP_USER": "1", "UV_FROZEN": "1", "UV_NO_BUILD": "1", "UV_PYTHON": "2.7", "UV_SYSTEM_PYTHON": "1",
    "UV_WORKING_DIR": "/", "GREP_OPTIONS": "-v", "POSIXLY_CORRECT": "1",
}  # fmt: skip


class Clone:
    """A clone with the line ends of Git for Windows, and a user's shell in another folder."""

    def __init__(self, folder):
        self.root, self.here = folder / "clone", folder / "here"
        line = ["git", "clone", "--quiet", "-c", "core.autocrlf=true", ROOT, self.root]
        subprocess.run(line, check=True)
        self.here.mkdir()
        lay_shadows(self.here)
        others = folder / "elsewhere"
        (others / "scripts").mkdir(parents=True)
        programs = folder / "programs"
        programs.mkdir()
        for place in ("/bin", "/usr/bin", "/usr/local/bin"):
            for program in Path(place).iterdir():
                if program.name not in ("cc", "uv") and not (programs / program.name).exists():
                    (programs / program.name).symlink_to(program)
        self.plain = os.environ | {"PATH": str(programs)}
        self.environment = self.plain | OTHERS | {"CDPATH": str(others)}

    def run(self, *line, folder=None, environment=None):
        """Run a program; returns what became of it."""
        return subprocess.run(
            list(map(str, line)), cwd=folder or self.here, env=environment or self.environment, capture_output=True,
            text=True, check=False,
        )  # fmt: skip

    def program(self, name):
        """Return a program of the users' environment."""
        return self.root / ".venv/bin" / name


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """Return a clone that was flown from once, without a C compiler and without uv."""
    found = Clone(tmp_path_factory.mktemp("user"))
    readme = (found.root / "README.md").read_text()
    (found.here / "mine.toml").write_text(re.search(r"```toml\n(.*?)```", readme, re.DOTALL)[1])
    line = ("mine.toml", "--headless", "--duration", 8, "--out", "flight")
    found.flown = found.run(os.path.relpath(found.root / "scripts/fly", found.here), *line)
    return found


def test_the_first_command_flies_whatever_the_shell_and_the_folder_contain(clone):
    assert clone.flown.returncode == 0, clone.flown.stdout + clone.flown.stderr
    assert clone.flown.stdout.endswith("flockwire: all well\n")
    assert "there is no C compiler" in clone.flown.stderr


def test_a_package_is_added_by_pip(clone):
    line = (clone.program("python"), "-P", "-m", "pip", "install", "--dry-run", "--no-index", "flockwire")
    done = clone.run(*line, environment=clone.plain)
    assert done.returncode == 0, done.stderr
    assert "Requirement already satisfied: flockwire in" in done.stdout


def test_tests_leave_the_users_environment_alone(clone):
    before = {file: file.stat().st_mtime_ns for file in (clone.root / ".venv").rglob("*")}
    done = clone.run("scripts/test", "--version", folder=clone.root)
    assert done.returncode == 0, done.stderr
    assert {file: file.stat().st_mtime_ns for file in (clone.root / ".venv").rglob("*")} == before


def test_who_edits_a_source_is_told_and_flies_the_edit(clone):
    file = clone.root / "operator/flockwire_operator/cli/entry.py"
    assert "\r" not in file.read_text()
    file.write_text(file.read_text().replace('print(f"flockwire {', 'print(f"edited {'))
    told = clone.run(clone.program("flockwire"), "check", "mine.toml", environment=clone.plain)
    assert f"{file} has changed since it was installed" in told.stderr
    assert clone.run(clone.root / "scripts/fly", "--help").returncode == 0
    again = clone.run(clone.program("flockwire"), "--version", environment=clone.plain)
    assert again.stdout.startswith("edited ")


def test_a_compiler_that_is_installed_later_compiles(clone):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    (Path(clone.plain["PATH"]) / "cc").symlink_to(compiler)
    for made in ROOT.glob("build/*/flockwire-made"):  # what was compiled already needs no minute more
        shutil.rmtree(clone.root / "build")
        wheel = shutil.copytree(made.parent, clone.root / made.parent.relative_to(ROOT))
        (wheel / made.name).touch()
    assert clone.run(clone.root / "scripts/fly", "--help").returncode == 0
    assert (clone.root / ".venv/flockwire-made").read_text() == "compiled\n"
    line = (clone.program("python"), "-P", "-c", "import flockwire_core.clock; print(flockwire_core.clock.__file__)")
    assert clone.run(*line, environment=clone.plain).stdout.endswith(".so\n")

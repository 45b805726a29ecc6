import os
import re
import stat
import subprocess

import pytest

COMMANDS = {
    "id": "echo 0",
    "uname": "echo x86_64",
    "systemctl": 'echo "systemctl $*" >> "$LOG"; [ "$1" != stop ]',  # which fails where there is nothing to stop
    # Makes an environment with itself as its Python.
    "python3": """
case "$*" in
  -c*) echo 3.11 ;;
  "-P -m venv"*) mkdir -p "$5/bin"; cp "$0" "$5/bin/python" ;;
  *) echo "python $*" >> "$LOG" ;;
esac""",
}


class Host:
    """A host in a folder, where the installer of a bundle is root."""

    def __init__(self, bundle, folder):
        self._bundle, self.root = bundle, folder / "root"
        self._commands, self._log = folder / "commands", folder / "log"
        self._commands.mkdir()
        for path in ("etc/systemd/system", "opt", "run/systemd/system"):
            (self.root / path).mkdir(parents=True)
        for name, text in COMMANDS.items():
            self.command(name, text)

    def of(self, bundle):
        """Return the same host with another bundle."""
        self._bundle = bundle
        return self

    def command(self, name, text):
        """Let a command of the host do what `text` says."""
        path = self._commands / name
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)

    def install(self, *arguments, umask=0o022):
        """Run install.sh; return its process and what it had done by others, line by line."""
        here = re.sub(r"(?<=[\s=])/(?=(etc|opt|run)/)", f"{self.root}/", (self._bundle / "install.sh").read_text())
        assert not re.search(r"(?<!\S)/(etc|opt|run)/", here)
        (self._bundle / "here.sh").write_text(here)
        self._log.write_text("")
        done = subprocess.run(
            ["/bin/sh", self._bundle / "here.sh", *arguments], capture_output=True, text=True, check=False, umask=umask,
            env={"PATH": f"{self._commands}:{os.defpath}", "LOG": str(self._log)},
        )  # fmt: skip
        return done, self._log.read_text().splitlines()


@pytest.fixture
def host(bundled, tmp_path):
    """Return the host pi1."""
    return Host(bundled / "pi1", tmp_path)


def test_an_installer_refuses_a_file_that_is_not_what_was_deployed(bundled, host):
    (bundled / "pi1" / "swarm" / "swarm.toml").write_text("another")
    done, called = host.install()
    assert done.returncode == 2
    assert "install: a file is not what was deployed" in done.stderr
    assert called == []


@pytest.mark.parametrize("arguments", [["--keys"], ["keys", "now"]])
def test_an_installer_refuses_an_argument_that_it_does_not_know(host, arguments):
    done, called = host.install(*arguments)
    assert done.returncode == 2
    assert f"install: {' '.join(arguments)}: must be keys, or nothing" in done.stderr
    assert called == []


@pytest.mark.parametrize(("command", "machine"), [("uname", "riscv64/3.11"), ("python3", "x86_64/3.13")])
def test_an_installer_on_another_machine_names_the_wheels_to_fetch(host, command, machine):
    architecture, _, python = machine.partition("/")
    host.command(command, f"echo {architecture if command == 'uname' else python}")
    done, called = host.install()
    assert done.returncode == 2
    wanted = f"this machine is {machine}; scripts/wheels {architecture} {python}"
    assert f"the wheels are for x86_64/3.11, aarch64/3.11, {wanted}" in done.stderr
    assert called == []
    assert not (host.root / "etc/flockwire").exists()


def test_wheels_of_a_version_that_is_installed_already_replace_it(host):
    done, called = host.install()
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in called if line.startswith("python -P -m pip install")]
    assert {"--force-reinstall", "--no-deps", "--require-hashes", "--no-index"} <= set(line.split())


def test_what_is_installed_can_be_read_by_all_whatever_roots_umask_is_but_for_the_keys(host):
    done, _ = host.install(umask=0o077)
    assert done.returncode == 0, done.stderr
    keys = host.root / "etc/flockwire/flock/keys"
    for path in [*(host.root / "etc/flockwire").rglob("*"), *(host.root / "opt/flockwire").rglob("*")]:
        private = keys in (path, *path.parents)
        readable = 0o055 if path.is_dir() else 0o044
        assert stat.S_IMODE(path.stat().st_mode) & readable == (0 if private else readable), path
    assert len(list(keys.iterdir())) == 6


def test_what_an_earlier_bundle_runs_is_stopped_while_its_units_are_there(host):
    old = host.root / "etc/systemd/system/flockwire-flock-uav9.service"
    old.touch()
    host.command("systemctl", f'[ "$1" != stop ] || [ -e {old} ] && echo "systemctl $*" >> "$LOG"')
    done, called = host.install()
    assert done.returncode == 0, done.stderr
    assert called[0] == "systemctl stop flockwire-flock.target"
    assert called[1].startswith("python -P -m pip")
    assert not old.exists()


def test_an_installer_does_not_wait_for_processes_that_wait_for_other_hosts(host):
    for arguments in ([], ["keys"]):
        done, called = host.install(*arguments)
        assert "flockwire-flock.target starts" in done.stdout
        assert called[-1] == "systemctl restart --no-block flockwire-flock.target"


def test_an_installer_does_without_systemd(host):
    (host.root / "run/systemd/system").rmdir()
    host.command("systemctl", "exit 1")
    done, _ = host.install()
    assert done.returncode == 0, done.stderr
    assert "is installed, not started" in done.stdout
    assert (host.root / "etc/systemd/system/flockwire-flock.target").exists()


def test_an_installation_that_fails_leaves_the_keys_of_what_runs(host):
    assert host.install()[0].returncode == 0
    keys = host.root / "etc/flockwire/flock/keys"
    (keys / "uav1.key").write_text("of what runs")
    host.command("python3", "echo 3.13")
    assert host.install()[0].returncode == 2
    (host.root / "opt/flockwire/flock/bin/python").write_text("#!/bin/sh\nexit 1\n")  # pip finds no place
    host.command("python3", COMMANDS["python3"])
    assert host.install()[0].returncode == 1
    assert (keys / "uav1.key").read_text() == "of what runs"


def test_new_keys_replace_the_old_ones_once_what_runs_has_ended(host):
    host.install()
    left = host.root / "etc/flockwire/flock/keys/uav9.key"
    left.touch()
    host.command("systemctl", f'echo "systemctl $*" $([ -e {left} ] && echo old) >> "$LOG"')
    done, called = host.install("keys")
    assert done.returncode == 0, done.stderr
    assert called[0] == "systemctl stop flockwire-flock.target old"
    assert called[-1] == "systemctl restart --no-block flockwire-flock.target"


def test_two_swarms_on_a_host_have_each_its_own_program(host, flockwire, swarm_file, wheels, tmp_path):
    host.install()
    program = host.root / "opt/flockwire/flock/bin/python"
    before = program.stat().st_ino
    swarm_file.write_text(swarm_file.read_text().replace('name = "flock"', 'name = "other"'))
    out = tmp_path / "second"
    flockwire("deploy", swarm_file, "--target", "systemd", "--wheels", wheels, "--out", out)
    _, called = host.of(out / "pi1").install()
    assert not any("flockwire-flock" in line for line in called)
    assert (host.root / "opt/flockwire/other/bin/python").exists()
    assert program.stat().st_ino == before
    unit = (host.root / "etc/systemd/system/flockwire-other-uav1.service").read_text()
    assert "ExecStart=/opt/flockwire/other/bin/flockwire agent " in unit


def test_new_keys_leave_a_host_alone_on_which_nothing_is_installed(host):
    done, called = host.install("keys")
    assert done.returncode == 0, done.stderr
    assert "is not installed on this host" in done.stdout
    assert called == []
    assert not (host.root / "etc/flockwire").exists()

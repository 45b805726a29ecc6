import hashlib
import os
import re
import shutil
import stat
import subprocess
import sys
import tarfile
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest
import tomli_w
import yaml
from bundles import BOTH, HOSTS
from command_line import refused
from flockwire_deploy.bundle import units
from flockwire_deploy.files import key_files
from flockwire_operator.station.host import Host


@pytest.fixture(params=["peers", "router"])
def plan(make_plan, request):
    return make_plan({**HOSTS, "network.mode": request.param})


def lines(unit, key):
    return [line.partition("=")[2] for line in unit.splitlines() if line.startswith(f"{key}=")]


def test_a_hosts_units_run_what_up_starts_there_with_the_same_arguments(plan):
    seen = []
    for host in plan.swarm.hosts:
        found = units(plan, host, "/prefix")
        here = plan.processes_on(host)
        seen += here
        assert set(found) == {"flockwire-flock.target", *(f"flockwire-flock-{identity}.service" for identity in here)}
        for identity in here:
            (line,) = lines(found[f"flockwire-flock-{identity}.service"], "ExecStart")
            file, out = Path("/etc/flockwire/flock/swarm/swarm.toml"), Path("/var/lib/flockwire/flock")
            dated = ["--dated"] if plan.rows[identity].records else []
            started = [*Host(plan, file, host, out, Path("%d")).command_line(identity), *dated]
            assert ["/prefix/bin/flockwire", *started[4:]] == line.split()
            assert started[:4] == [sys.executable, "-P", "-m", "flockwire_operator"]
    assert sorted(seen) == sorted(plan.started)


def test_a_unit_has_the_keys_of_its_process_alone(plan):
    for host in plan.swarm.hosts:
        for identity in plan.processes_on(host):
            text = units(plan, host)[f"flockwire-flock-{identity}.service"]
            loaded = [entry.partition(":")[0] for entry in lines(text, "LoadCredential")]
            assert loaded == list(key_files(plan, identity))
            assert [name for name in loaded if name.endswith(".key")] == [f"{identity}.key"]


def test_what_a_process_needs_ends_after_it_and_all_wait_for_a_router(plan):
    for host in plan.swarm.hosts:
        here = plan.processes_on(host)
        for identity in here:
            (after,) = lines(units(plan, host)[f"flockwire-flock-{identity}.service"], "After")
            named = set(re.findall(r"flockwire-flock-(\w+)\.service", after))
            if identity in plan.routers:
                assert not named
            else:
                higher = {other for other in here if plan.rows[other].rank > plan.rows[identity].rank}
                assert named == (higher | set(plan.routers)) & set(here)


def test_a_host_gets_its_own_keys_and_no_other_hosts(bundled, make_plan):
    plan = make_plan(HOSTS)
    for host in plan.swarm.hosts:
        held = {path.name for path in (bundled / host / "keys").iterdir()}
        wanted = {f"{identity}.{end}" for identity in plan.processes_on(host) for end in ("crt", "key")}
        assert held == wanted | {"ca.crt", "operators.crt"}
        assert all(stat.S_IMODE(path.stat().st_mode) == 0o600 for path in (bundled / host / "keys").iterdir())


def test_every_file_of_a_bundle_is_summed_and_every_wheel_required_by_its_digest(bundled, wheels):
    folder = bundled / "pi1"
    summed = dict(reversed(line.split("  ")) for line in (folder / "SHA256SUMS").read_text().splitlines())
    files = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()} - {"SHA256SUMS"}
    assert set(summed) == files
    assert all(hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest for name, digest in summed.items())
    required = (folder / "requirements.txt").read_text().splitlines()
    assert [line.split()[0] for line in required] == [f"flockwire=={version('flockwire')}", "numpy==2.4.0"]
    for name in (BOTH.format("x86_64"), BOTH.format("aarch64")):
        assert hashlib.sha256((wheels / name).read_bytes()).hexdigest() in required[1]


def test_a_trace_that_is_replayed_goes_along_and_is_found_there(flockwire, swarm_file, swarm_table, wheels, tmp_path):
    replay = {"gateway": {"source": "replay", "replay": {"trace": "runs/trace.mcap"}}}
    swarm_file.write_text(tomli_w.dumps(swarm_table({**HOSTS, **replay})))
    line = ["deploy", swarm_file, "--target", "systemd", "--wheels", wheels, "--out", tmp_path / "out"]
    assert "gateway.replay.trace = 'runs/trace.mcap': must lie in the swarm file's folder" in refused(flockwire(*line))
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "trace.mcap").write_bytes(b"\x89MCAP")
    assert flockwire(*line).returncode == 0
    assert (tmp_path / "out" / "pi2" / "swarm" / "runs" / "trace.mcap").read_bytes() == b"\x89MCAP"
    unit = (tmp_path / "out" / "pi2" / "units" / "flockwire-flock-gateway.service").read_text()
    assert lines(unit, "WorkingDirectory") == ["/etc/flockwire/flock/swarm"]


def test_an_installed_law_travels_by_its_wheel_or_is_copied(
    flockwire, swarm_file, swarm_table, wheels, tmp_path, documented_law
):
    swarm_file.write_text(tomli_w.dumps(swarm_table({**HOSTS, "control.law": documented_law})))
    line = ["deploy", swarm_file, "--target", "systemd", "--wheels", wheels, "--out", tmp_path / "out"]
    assert flockwire(*line).returncode == 0
    copied = tmp_path / "out" / "pi1" / "swarm" / "my_law.py"
    assert copied.read_text() == (tmp_path / "installed" / "my_law.py").read_text()
    with zipfile.ZipFile(wheels / "my_law-1.0-py3-none-any.whl", "w") as wheel:
        wheel.write(tmp_path / "installed" / "my_law.py", "my_law.py")
    assert flockwire(*line).returncode == 0
    assert "my-law==1.0" in (tmp_path / "out" / "pi1" / "requirements.txt").read_text()
    assert not copied.exists()


PACKAGE = """from pathlib import Path

from flockwire.law import Decision, Information

from .gains import GAIN

LEARNED = Path(__file__).with_name("weights.txt").read_text()


class Still:
    information = Information(leaders=(0, 1))

    def __init__(self, settings):
        self.gain = GAIN

    def step(self, observation):
        return Decision()
"""


@pytest.mark.parametrize("target", ["systemd", "compose"])
def test_a_package_beside_the_swarm_file_travels_with_its_data(
    flockwire, swarm_file, swarm_table, wheels, tmp_path, target
):
    package = swarm_file.parent / f"flockwire_swallows_{target}"
    package.mkdir()
    for name, text in {"__init__": "", "gains": "GAIN = 2.0\n", "law": PACKAGE}.items():
        (package / f"{name}.py").write_text(text)
    (package / "weights.txt").write_text("0.5")
    hosts = HOSTS if target == "systemd" else {}
    swarm_file.write_text(tomli_w.dumps(swarm_table({**hosts, "control.law": f"{package.name}.law:Still"})))
    out = tmp_path / "out"
    done = flockwire("deploy", swarm_file, "--target", target, "--wheels", wheels, "--out", out)
    assert done.returncode == 0, done.stderr
    there = out / "pi1" / "swarm" if target == "systemd" else out / "swarm"
    names = {path.relative_to(there).as_posix() for path in there.rglob("*") if path.is_file()}
    assert {f"{package.name}/{name}" for name in ("__init__.py", "gains.py", "law.py", "weights.txt")} < names
    assert not [name for name in names if "__pycache__" in name]


def test_a_file_travels_with_what_it_imports_and_its_weights(flockwire, swarm_file, swarm_table, wheels, tmp_path):
    text = PACKAGE.replace("from .gains", "from gains_beside").replace(
        'Path(__file__).with_name("weights.txt").read_text()', '""'
    )
    (swarm_file.parent / "still.py").write_text(text)
    (swarm_file.parent / "gains_beside.py").write_text("GAIN = 2.0\n")
    for name in ("other.py", "still.npy", "other.npy"):
        (swarm_file.parent / name).write_text("")
    swarm_file.write_text(tomli_w.dumps(swarm_table({**HOSTS, "control.law": "still.py:Still"})))
    line = ["deploy", swarm_file, "--target", "systemd", "--wheels", wheels, "--out", tmp_path / "out"]
    assert flockwire(*line).returncode == 0
    there = tmp_path / "out" / "pi1" / "swarm"
    assert {path.name for path in there.glob("*.*py")} == {"still.py", "still.npy", "gains_beside.py"}


def test_a_law_beside_the_swarm_file_travels_with_it(
    flockwire, swarm_file, swarm_table, wheels, tmp_path, example, documented_law
):
    line = ["deploy", swarm_file, "--target", "systemd", "--wheels", wheels, "--out", tmp_path / "out"]
    (tmp_path / "mine.py").write_text(example("own_law", "python"))
    for law in ("mine.py:MyLaw", "mine:MyLaw"):
        swarm_file.write_text(tomli_w.dumps(swarm_table({**HOSTS, "control.law": law})))
        assert flockwire(*line).returncode == 0
        assert (tmp_path / "out" / "pi1" / "swarm" / "mine.py").read_text() == example("own_law", "python")
        shutil.rmtree(tmp_path / "out")
    elsewhere = {"control.law": f"{tmp_path}/installed/my_law.py:MyLaw"}
    swarm_file.write_text(tomli_w.dumps(swarm_table({**HOSTS, **elsewhere})))
    assert "must lie in the swarm file's folder" in refused(flockwire(*line))


def test_the_inventory_has_the_hosts_addresses(bundled):
    hosts = yaml.safe_load((bundled / "inventory.yaml").read_text())["all"]["hosts"]
    assert {name: host["ansible_host"] for name, host in hosts.items()} == {
        "station": "192.0.2.1", "pi1": "192.0.2.11", "pi2": "192.0.2.12",
    }  # fmt: skip
    packed = bundled / "pi1.tar"
    assert stat.S_IMODE(packed.stat().st_mode) == 0o600
    with tarfile.open(packed) as archive:
        names = {name.removeprefix("./") for name in archive.getnames()}
    assert {"install.sh", "SHA256SUMS", "keys/uav1.key", "keys/uav2.key"} < names
    assert "keys/uav3.key" not in names
    (play,) = yaml.safe_load((bundled / "playbook.yaml").read_text())
    assert play["become"] is True


def test_deploying_again_takes_out_what_a_host_no_longer_runs(bundled, flockwire, swarm_table, swarm_file, wheels):
    swarm_file.write_text(tomli_w.dumps(swarm_table({**HOSTS, "drones.2.host": "pi2"})))
    flockwire("deploy", swarm_file, "--target", "systemd", "--wheels", wheels, "--out", bundled)
    assert {path.name for path in (bundled / "pi1" / "keys").glob("*.key")} == {"uav1.key"}
    assert not (bundled / "pi1" / "units" / "flockwire-flock-uav2.service").exists()
    assert (bundled / "pi2" / "keys" / "uav2.key").exists()


def test_the_bundle_of_a_host_that_no_longer_exists_is_removed_and_nothing_else_is(
    bundled, flockwire, swarm_table, swarm_file, wheels
):
    moved = {**HOSTS, "drones.1.host": "pi2", "drones.2.host": "pi2", "hosts.pi1": None}
    (bundled / "notes").mkdir()
    shutil.copytree(bundled / "pi1", bundled / "kept")
    shutil.copytree(bundled / "pi1", bundled / "another")
    target = bundled / "another" / "units" / "flockwire-flock.target"
    target.rename(target.with_name("flockwire-another.target"))
    swarm_file.write_text(tomli_w.dumps(swarm_table(moved)))
    done = flockwire("deploy", swarm_file, "--target", "ansible", "--wheels", wheels, "--out", bundled)
    assert done.returncode == 0, done.stderr
    held = {path.name for path in bundled.iterdir()}
    assert held == {
        "station", "pi2", "station.tar", "pi2.tar", "another", "kept", "notes", "inventory.yaml", "playbook.yaml",
    }  # fmt: skip


def test_a_host_that_runs_nothing_is_refused(flockwire, swarm_file, swarm_table, wheels, tmp_path):
    swarm_file.write_text(tomli_w.dumps(swarm_table({**HOSTS, "hosts.pi9.address": "192.0.2.19"})))
    line = refused(
        flockwire("deploy", swarm_file, "--target", "systemd", "--wheels", wheels, "--out", tmp_path / "out")
    )
    assert "hosts.pi9: runs nothing" in line


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd-analyze")
def test_systemd_takes_the_units_and_finds_them_safe(make_plan, tmp_path):
    plan = make_plan(HOSTS)
    prefix = tmp_path / "prefix"
    (prefix / "bin").mkdir(parents=True)
    (prefix / "bin" / "flockwire").symlink_to("/bin/true")
    written = []
    for name, text in units(plan, "station", str(prefix)).items():
        (tmp_path / name).write_text(text)
        written += [tmp_path / name]
    verified = subprocess.run(
        ["systemd-analyze", "--man=no", "verify", *written], capture_output=True, text=True, check=False
    )
    about = [line for line in verified.stderr.splitlines() if "flockwire" in line]
    assert (verified.returncode, about) == (0, [])
    for unit in (path for path in written if path.suffix == ".service"):
        done = subprocess.run(
            ["systemd-analyze", "security", "--offline=true", unit], capture_output=True, text=True, check=True
        )
        level = re.search(r"Overall exposure level for \S+: ([\d.]+)", done.stdout)
        assert level is not None
        assert float(level[1]) < 3.0


def test_a_tar_of_private_keys_is_its_owners_alone_though_an_older_one_was_not(flockwire, bundled, swarm_file, wheels):
    tar = bundled / "pi1.tar"
    tar.chmod(0o644)
    with tar.open("rb") as opened:
        flockwire("deploy", swarm_file, "--target", "ansible", "--wheels", wheels, "--out", bundled)
        assert stat.S_IMODE(tar.stat().st_mode) == 0o600
        assert os.fstat(opened.fileno()).st_ino != tar.stat().st_ino  # who has the old one open reads no new key

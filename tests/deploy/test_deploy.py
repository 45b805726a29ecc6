import os
import shutil
import stat
import subprocess

import pytest
import tomli_w
from command_line import refused
from flockwire_core.security.files import default_folder, hold
from flockwire_deploy import compose

ALONE = {"graph.edges": [[0, 1]], "drones": [{"id": i, "start": [3.0 * i, 0.0, 0.0]} for i in range(2)]}


@pytest.fixture
def write_swarm(tmp_path, swarm_table):
    """Return a writer of swarm files."""

    def write(changes=None, name="swarm.toml"):
        path = tmp_path / name
        path.write_text(tomli_w.dumps(swarm_table({**ALONE, **(changes or {})})))
        return path

    return write


@pytest.fixture
def no_engine(monkeypatch):
    monkeypatch.setattr(compose.shutil, "which", lambda _: None)


pytestmark = pytest.mark.usefixtures("no_engine")


def test_a_process_gets_its_own_keys_and_nobody_elses(flockwire, write_swarm, tmp_path):
    out = tmp_path / "out"
    done = flockwire("deploy", write_swarm(), "--out", out)
    assert done.returncode == 0, done.stderr
    assert "docker compose -f" in done.stdout
    held = {path.name: {file.name for file in path.iterdir()} for path in (out / "keys").iterdir()}
    for identity, files in held.items():
        assert files == {"ca.crt", "operators.crt", f"{identity}.crt", f"{identity}.key"}
        assert stat.S_IMODE((out / "keys" / identity / f"{identity}.key").stat().st_mode) == 0o600
    assert {"uav1", "gateway", "operator"} < set(held)
    user = (out / ".env").read_text().split("FLOCKWIRE_USER=")[1].strip()
    owner = (out / "keys" / "uav1" / "uav1.key").stat()
    assert user == f"{owner.st_uid}:{owner.st_gid}"
    assert owner.st_uid == (os.getuid() or 10001)  # never root


def test_rotated_keys_are_copied_to_hosts_by_deploying_again(flockwire, write_swarm, tmp_path):
    file, out = write_swarm(), tmp_path / "out"
    flockwire("deploy", file, "--out", out)
    old = (out / "keys" / "uav1" / "uav1.crt").read_bytes()
    (out / "keys" / "uav1" / "gateway.key").write_text("left from elsewhere")
    flockwire("keys", file, "--rotate")
    flockwire("deploy", file, "--out", out)
    new = (out / "keys" / "uav1" / "uav1.crt").read_bytes()
    assert new != old
    assert new == (default_folder("flock", file.parent) / "uav1.crt").read_bytes()
    assert not (out / "keys" / "uav1" / "gateway.key").exists()


def test_keys_that_containers_run_with_are_not_replaced_by_those_of_another_authority(flockwire, write_swarm, tmp_path):
    file, out = write_swarm(), tmp_path / "out"
    flockwire("deploy", file, "--out", out)
    with hold(out / "keys" / "uav1"):
        assert flockwire("deploy", file, "--out", out).returncode == 0
        flockwire("keys", file, "--rotate")
        old = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
        assert "uav1: processes of this machine run with these keys" in refused(flockwire("deploy", file, "--out", out))
        assert {path: path.read_bytes() for path in old} == old
    assert flockwire("deploy", file, "--out", out).returncode == 0


def test_the_keys_of_a_process_that_no_longer_exists_are_removed_and_nothing_else_is(flockwire, write_swarm, tmp_path):
    out = tmp_path / "out"
    more = {"graph.edges": [[0, 1], [0, 2]], "drones": [{"id": i, "start": [3.0 * i, 0.0, 0.0]} for i in range(3)]}
    flockwire("deploy", write_swarm(more), "--out", out)
    assert (out / "keys" / "uav2" / "uav2.key").exists()
    (out / "keys" / "mine").mkdir()
    (out / "keys" / "note").touch()
    flockwire("deploy", write_swarm(), "--out", out)
    held = {path.name for path in (out / "keys").iterdir()}
    assert {"uav1", "gateway", "mine", "note"} < held
    assert "uav2" not in held


def test_files_that_the_swarm_names_go_along(flockwire, write_swarm, tmp_path):
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames" / "f.csv").write_text("t,drone,x,y,z\n0,1,1,0,0\n5,1,2,0,0\n")
    file = write_swarm({"formation": {"kind": "key_frames", "file": "frames/f.csv"}})
    done = flockwire("deploy", file, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert flockwire("check", tmp_path / "out" / "swarm" / "swarm.toml").returncode == 0
    (tmp_path / "below").mkdir()
    file = write_swarm({"formation": {"kind": "key_frames", "file": "../frames/f.csv"}}, "below/swarm.toml")
    line = refused(flockwire("deploy", file, "--out", tmp_path / "other"))
    assert "formation.file = '../frames/f.csv': must lie in the swarm file's folder" in line


def test_keys_of_another_swarm_are_refused(flockwire, write_swarm, tmp_path):
    other = write_swarm({"name": "other"}, "other.toml")
    flockwire("keys", other, "--out", tmp_path / "keys")
    line = refused(flockwire("deploy", write_swarm(), "--keys", tmp_path / "keys", "--out", tmp_path / "out"))
    assert "are of 'flockwire other', this swarm is 'flock'" in line


def test_the_keys_of_a_swarm_with_the_longest_name_are_its_own(flockwire, write_swarm, tmp_path):
    file = write_swarm({"name": "a" * 64})
    for _ in range(2):
        done = flockwire("deploy", file, "--out", tmp_path / "out")
        assert done.returncode == 0, done.stderr


def test_keys_that_lack_those_of_another_host_are_refused_by_name(flockwire, write_swarm, tmp_path):
    file, keys = write_swarm(), tmp_path / "keys"
    flockwire("keys", file, "--out", keys)
    shutil.rmtree(keys / "authority")
    (keys / "uav1.crt").unlink()
    (keys / "uav1.key").unlink()
    line = refused(flockwire("deploy", file, "--keys", keys, "--out", tmp_path / "out"))
    assert f"--keys = {keys}: has no uav1.crt" in line


def test_a_bad_range_and_a_swarm_without_security_are_refused(flockwire, write_swarm, tmp_path):
    assert "--subnets = '10.0.0.1/8'" in refused(flockwire("deploy", write_swarm(), "--subnets", "10.0.0.1/8"))
    file = write_swarm({"network.security": "none"}, "open.toml")
    assert "network.security = 'none'" in refused(flockwire("deploy", file, "--out", tmp_path / "out"))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"gateway": {"source": "vrpn", "vrpn": {"server": "192.0.2.9"}}},
            "gateway.source = 'vrpn': containers cannot",
        ),
        ({"drones.1.airframe": "tello"}, "drones.1.airframe = 'tello': containers cannot reach such a drone"),
    ],
)
def test_what_containers_cannot_reach_is_refused(flockwire, write_swarm, tmp_path, changes, said):
    line = refused(flockwire("deploy", write_swarm(changes), "--out", tmp_path / "out"))
    assert said in line
    assert "--target systemd" in line


def test_an_installed_law_which_the_image_lacks_is_copied(flockwire, write_swarm, tmp_path, documented_law):
    done = flockwire("deploy", write_swarm({"control.law": documented_law}), "--out", tmp_path / "out")
    assert done.returncode == 0
    copied = tmp_path / "out" / "swarm" / "my_law.py"
    assert copied.read_text() == (tmp_path / "installed" / "my_law.py").read_text()


def test_an_engine_problem_is_one_line_with_the_remedy(monkeypatch):
    answers = {}

    def run(line, **_):
        answer = answers.get(line[1])
        if answer is None:
            raise subprocess.TimeoutExpired(line, 1.0)
        return subprocess.CompletedProcess(line, 0 if answer else 1, answer, "")

    assert "install Docker Engine" in compose.obstacle()
    monkeypatch.setattr(compose.shutil, "which", lambda _: "/usr/bin/docker")
    monkeypatch.setattr(compose.subprocess, "run", run)
    assert "does not answer; start it" in compose.obstacle()
    answers["version"] = "amd64\n"
    answers["image"] = ""
    assert "no image 'flockwire'; scripts/image builds it" in compose.obstacle()
    answers["image"] = "arm64\n"
    assert "is for arm64, the engine's machine is amd64" in compose.obstacle()
    answers["image"] = "amd64\n"
    assert compose.obstacle() == ""


def test_the_engine_that_is_missing_is_a_warning(flockwire, write_swarm, tmp_path):
    done = flockwire("deploy", write_swarm(), "--out", tmp_path / "out")
    assert done.stderr.startswith("flockwire: warning: there is no docker")
    assert done.returncode == 0

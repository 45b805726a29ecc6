"""The bundles of hosts, installed for real in containers: skipped by name where no engine answers."""

import os
import shutil
import sys

import pytest
from containers import FLOCKWIRE, ROOT, SWARM, base_image, missing, run

pytestmark = [pytest.mark.long, pytest.mark.integration]

# What systemd does with a unit: its credentials in a folder, a socket to be told at, its command line.
SUPERVISE = """
import os, socket, subprocess, sys
told = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM); told.bind("/tmp/notify"); told.settimeout(20)
unit = open(sys.argv[1]).read().splitlines()
line = next(entry for entry in unit if entry.startswith("ExecStart="))[10:].replace("%d", sys.argv[2]).split()
process = subprocess.Popen(line, env={**os.environ, "NOTIFY_SOCKET": "/tmp/notify", "WATCHDOG_USEC": "400000"})
for _ in range(4):
    print(told.recv(100))
process.terminate()
print("ended", process.wait(10))
"""


@pytest.fixture(scope="module")
def base():
    """Return a minimal image of a host: Debian with Python."""
    if line := missing():
        pytest.skip(f"containers: {line}")
    return base_image()


@pytest.fixture(scope="module")
def bundles(base, tmp_path_factory):
    """Return the folder with the bundles of a swarm of three hosts."""
    run(ROOT / "scripts/wheels", timeout=400)
    folder = tmp_path_factory.mktemp("lab")
    (folder / "lab.toml").write_text(SWARM)
    line = [FLOCKWIRE, "deploy", folder / "lab.toml", "--target", "ansible"]
    run(*line, "--wheels", ROOT / "dist/wheels", "--out", folder / "out")
    return folder / "out"


def test_a_bundle_installs_and_starts_without_a_network_and_holds_no_other_hosts_keys(base, bundles):
    unit = "/etc/systemd/system/flockwire-lab-uav1.service"
    keys = "/etc/flockwire/lab/keys"
    steps = f'/bundle/install.sh && ls {keys} && python3 -c "$SUPERVISE" {unit} {keys}'
    line = ["docker", "run", "--rm", "--network", "none", "-v", f"{bundles / 'pi1'}:/bundle:ro"]
    done = run(*line, "-e", f"SUPERVISE={SUPERVISE}", base, "sh", "-c", steps, timeout=300)
    said = done.stdout.splitlines()
    assert "installed, not started" in said[0]
    assert said[1:5] == ["ca.crt", "operators.crt", "uav1.crt", "uav1.key"]
    assert said[5:] == [repr(b"READY=1\nWATCHDOG=1"), *[repr(b"WATCHDOG=1")] * 3, "ended 0"]


def test_an_installer_on_another_machine_names_the_wheels_to_fetch(base, bundles):
    other = "#!/bin/sh\necho riscv64\n"
    steps = f"printf '{other}' > /usr/local/bin/uname && chmod +x /usr/local/bin/uname && /bundle/install.sh"
    line = ["docker", "run", "--rm", "--network", "none", "-v", f"{bundles / 'pi1'}:/bundle:ro", base, "sh", "-c"]
    done = run(*line, steps, check=False)
    assert done.returncode == 2
    assert "this machine is riscv64/3.11; scripts/wheels riscv64 3.11" in done.stderr


HOST = "flockwire-test-host"
DOCKERFILE = """
FROM {base}
RUN apt-get update -q && apt-get install -qy --no-install-recommends openssh-server && mkdir -p /run/sshd /root/.ssh
CMD ["/usr/sbin/sshd", "-D"]
"""


@pytest.fixture
def ansible(tmp_path):
    """Return ansible-playbook, in an environment of its own."""
    run(sys.executable, "-m", "venv", tmp_path / "ansible", timeout=120)
    if run(tmp_path / "ansible/bin/pip", "install", "-q", "ansible-core", timeout=240, check=False).returncode:
        pytest.skip("ansible-core cannot be fetched")
    return tmp_path / "ansible/bin/ansible-playbook"


@pytest.fixture
def machines(base, tmp_path):
    """Return the addresses, by host, of containers that one logs in to by SSH, and the key for it."""
    if shutil.which("ssh-keygen") is None:
        pytest.skip("there is no ssh-keygen")
    (tmp_path / "Dockerfile").write_text(DOCKERFILE.format(base=base))
    if run("docker", "build", "-q", "-t", HOST, tmp_path, timeout=300, check=False).returncode:
        pytest.skip("openssh-server cannot be fetched")
    key = tmp_path / "id"
    run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key)
    names = [f"{HOST}-{host}" for host in ("pi1", "pi2")]
    try:
        for name in names:
            run("docker", "run", "-d", "--name", name, HOST)
            run("docker", "cp", f"{key}.pub", f"{name}:/root/.ssh/authorized_keys")
            run("docker", "exec", name, "chown", "root:root", "/root/.ssh/authorized_keys")
        address = "{{.NetworkSettings.IPAddress}}"
        yield {name[-3:]: run("docker", "inspect", "-f", address, name).stdout.strip() for name in names}, key
    finally:
        run("docker", "rm", "-f", *names, check=False)


def test_the_playbook_brings_each_host_its_own_and_after_a_loss_new_keys(bundles, machines, ansible, tmp_path):
    addresses, key = machines
    swarm = tmp_path / "lab.toml"
    here = run("docker", "inspect", "-f", "{{.NetworkSettings.Gateway}}", f"{HOST}-pi1").stdout.strip()
    hosts = {"station": here, **addresses}
    tables = ", ".join(f'{host} = {{ address = "{address}" }}' for host, address in hosts.items())
    swarm.write_text(SWARM.replace("station = {}, pi1 = {}, pi2 = {}", tables))
    out = tmp_path / "out"
    deploy = [FLOCKWIRE, "deploy", swarm, "--target", "ansible", "--out", out]
    deploy += ["--wheels", ROOT / "dist/wheels"]
    login = [ansible, "-i", out / "inventory.yaml", "-u", "root", "--private-key", key, "-l", "all:!station"]
    quiet = {**os.environ, "ANSIBLE_HOST_KEY_CHECKING": "False", "ANSIBLE_LOCALHOST_WARNING": "False"}
    run(*deploy)
    run(*login, out / "playbook.yaml", timeout=500, env=quiet)
    first = {host: held(host) for host in addresses}
    assert {host: sorted(files) for host, files in first.items()} == {
        "pi1": ["ca.crt", "operators.crt", "uav1.crt", "uav1.key"],
        "pi2": ["ca.crt", "operators.crt", "uav2.crt", "uav2.key"],
    }
    run(FLOCKWIRE, "keys", swarm, "--rotate")
    run(*deploy)
    run(*login, out / "playbook.yaml", "--tags", "keys", timeout=300, env=quiet)
    second = {host: held(host) for host in addresses}
    assert all(first[host][name] != second[host][name] for host in addresses for name in first[host])


def held(host):
    """Return the digests of the keys that a host holds, by name."""
    said = run("docker", "exec", f"{HOST}-{host}", "sh", "-c", "cd /etc/flockwire/lab/keys && sha256sum *").stdout
    return dict(reversed(line.split()) for line in said.splitlines())

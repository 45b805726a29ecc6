"""A swarm of containers, flown for real: skipped by name where no engine answers."""

import json
import os
import shutil
import signal

import pytest
from containers import FLOCKWIRE, IMAGE, OPERATOR, SWARM, Swarm, image, missing, run, until

pytestmark = [pytest.mark.long, pytest.mark.integration]
PILOTS = ("leader", "uav1", "uav2")
KILLED = "uav1"  # in the middle of the chain


@pytest.fixture(scope="module")
def built():
    """Return the image of this tree."""
    if line := missing():
        pytest.skip(f"containers: {line}")
    return image()


@pytest.fixture(scope="module")
def deployed(built, tmp_path_factory):
    """Return a swarm as a folder of containers; none of them is left at the end."""
    folder = tmp_path_factory.mktemp("deployed")
    (folder / "lab.toml").write_text(SWARM)
    line = [FLOCKWIRE, "deploy", folder / "lab.toml", "--target", "compose"]
    run(*line, "--keys", folder / "all-keys", "--out", folder / "swarm")
    swarm = Swarm(folder / "swarm")
    yield swarm
    swarm("down", "--timeout", 5, check=False)


@pytest.fixture(scope="module")
def flight(deployed):
    """Return the swarm in flight, and what it had logged when its conductor was done."""
    deployed("up", "-d", DURATION="12")
    until(lambda: "report:" in deployed.log("operator"), 90, "a conducted flight with its report")
    return deployed


def phase(swarm, identity):
    """Return what a process last logged that it does."""
    lines = [line for line in swarm.log(identity).splitlines() if f" {identity}: " in line]
    return lines[-1].partition(f" {identity}: ")[2] if lines else ""


def settle(swarm, wanted):
    until(lambda: all(phase(swarm, name).startswith(wanted) for name in PILOTS), 45, f"all in {wanted}")


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def test_it_flies_and_leaves_trace_and_report_in_a_volume(flight):
    newest = max(flight.runs.glob("*/trace.mcap")).parent
    checks = {check["name"]: check for check in summary(newest)["checks"]}
    named = ["separation", "lost drones", "landed"]
    if checks["control rate"]["value"] > 0.8:  # else the machine was too busy to tell
        named += ["formation settled", "formation tail"]
    assert [checks[name] for name in named if not checks[name]["ok"]] == []
    assert (newest / "report.html").exists()


def test_a_container_is_not_root_writes_nowhere_and_is_healthy(flight):
    until(lambda: flight.inspected(KILLED)["State"]["Health"]["Status"] == "healthy", 40, "a healthy agent")
    found = flight.inspected(KILLED)
    assert found["HostConfig"]["ReadonlyRootfs"]
    assert found["Config"]["User"].split(":")[0] != "0"
    keys = run("docker", "exec", flight.container(KILLED), "ls", "/keys").stdout.split()
    assert sorted(keys) == ["ca.crt", "operators.crt", f"{KILLED}.crt", f"{KILLED}.key"]


def test_a_process_has_no_package_of_the_operator(flight):
    code = "import importlib.util as u; print(*(n for n in ('typer', 'scipy', 'matplotlib') if u.find_spec(n)))"
    for identity, name in ((KILLED, IMAGE), ("operator", OPERATOR)):
        assert flight.inspected(identity)["Config"]["Image"] == name
    for name, expected in ((IMAGE, ""), (OPERATOR, "typer scipy matplotlib")):
        assert run("docker", "run", "--rm", "--entrypoint", "python", name, "-c", code).stdout.strip() == expected


def test_a_container_that_is_down_delays_no_process_that_dials_it(flight):
    code = "import socket, time; began = time.monotonic()\ntry: socket.getaddrinfo('nobody', 1)\n"
    code += "except OSError: print(time.monotonic() - began)"
    assert float(run("docker", "exec", flight.container(KILLED), "python", "-c", code).stdout) < 1.0


def back(swarm, since):
    """Wait until KILLED has said since then that it flies, or that it is on the ground and ready."""
    said = ("formation", "hold", "ready")
    until(lambda: len(swarm.log(KILLED)) > since and phase(swarm, KILLED).startswith(said), 45, f"{KILLED} back")


def test_an_agent_that_dies_in_flight_comes_back_and_so_does_one_that_loses_its_networks(flight):
    assert "confirmed by" in flight.order("start")
    settle(flight, "formation")
    before, said = flight.inspected(KILLED)["State"]["Pid"], len(flight.log(KILLED))
    os.kill(before, signal.SIGKILL)  # `docker kill` would also tell the engine to leave it
    until(lambda: flight.inspected(KILLED)["State"]["Pid"] not in (0, before), 20, "a container that is started again")
    back(flight, said)
    flight.order("start")  # its drone may have landed meanwhile
    settle(flight, "formation")

    networks, container = flight.inspected(KILLED)["NetworkSettings"]["Networks"], flight.container(KILLED)
    said = len(flight.log(KILLED))
    for name in networks:
        run("docker", "network", "disconnect", name, container)
    until(lambda: len(flight.log(KILLED)) > said, 20, "an agent that misses its inputs")
    for name, settings in networks.items():
        aliases = [word for alias in settings["Aliases"] or () for word in ("--alias", alias)]
        run("docker", "network", "connect", *aliases, name, container)
    back(flight, said)
    flight.order("start")
    settle(flight, "formation")
    assert "confirmed by" in flight.order("land")
    settle(flight, ("grounded", "ready"))
    trace = max(flight.runs.glob("*/trace.mcap"))
    run(FLOCKWIRE, "report", trace, "--out", trace.parent / "again", check=False)
    checks = {check["name"]: check for check in summary(trace.parent / "again")["checks"]}
    assert checks["separation"]["ok"], checks["separation"]


def probe(folder, swarm_folder, networks, out):
    """Run the probe in a container on `networks`, with all keys; returns what it printed and its results."""
    name = "flockwire-test-probe"
    user = (swarm_folder / ".env").read_text().split("FLOCKWIRE_USER=")[1].strip()
    out.mkdir()
    for path in (folder, *folder.rglob("*"), out):
        shutil.chown(path, *map(int, user.split(":")))
    first = ["--network", networks[0]] if networks else ["--network", "none"]
    line = ["docker", "create", "--name", name, *first, "--user", user, "--read-only", "--tmpfs", "/tmp"]
    line += ["-e", "FLOCKWIRE_BY_NAME=1", "-v", f"{folder}:/keys", "-v", f"{swarm_folder / 'swarm'}:/swarm:ro"]
    line += ["-v", f"{out}:/out", OPERATOR, "probe", "/swarm/swarm.toml", "--keys", "/keys", "--out", "/out"]
    try:
        run(*line)
        for network in networks[1:]:
            run("docker", "network", "connect", network, name)
        done = run("docker", "start", "-a", name, timeout=280, check=False)
        results = out / "probe.json"
        return done.stdout + done.stderr, json.loads(results.read_text()) if results.exists() else None
    finally:
        run("docker", "rm", "-f", name, check=False)


@pytest.mark.campaign
def test_the_probe_from_inside_finds_no_leak(flight, tmp_path):
    project = flight.inspected("operator")["NetworkSettings"]["Networks"]
    said, results = probe(flight.folder.parent / "all-keys", flight.folder, sorted(project), tmp_path / "out")
    assert results is not None, said
    assert results["leaks"] == [], said
    seen = {attacker["identity"]: attacker for attacker in results["attackers"]}
    linked = [name for name, attacker in seen.items() if attacker["links"]]
    assert linked == list(seen)[3:]  # all but the three without good keys
    assert {*PILOTS, "gateway", "recorder", "operator"} < set(linked)
    assert seen["gateway"]["published"]  # what it may publish arrives in containers too


def test_a_foreign_container_reaches_no_process(flight):
    """A container on no network of the swarm finds none of its names, and from none of its addresses an answer."""
    addresses = [
        settings["IPAddress"]
        for identity in ("uav1", "gateway")
        for settings in flight.inspected(identity)["NetworkSettings"]["Networks"].values()
    ]
    code = (
        "import socket, sys\n"
        "for host in sys.argv[1:]:\n"
        "    try:\n"
        "        socket.create_connection((host, 7450), 0.5); print('reached', host)\n"
        "    except OSError as error:\n"
        "        print(host, error)\n"
    )
    line = ["docker", "run", "--rm", "--entrypoint", "python", IMAGE, "-c", code, "uav1", "gateway", *addresses]
    said = run(*line).stdout
    assert len(said.splitlines()) == 2 + len(addresses)
    assert "reached" not in said


TELLO_CLIENT = """
import socket, sys
drone = (sys.argv[1], 8889)
state = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); state.bind(("", 8890)); state.settimeout(5)
sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); sender.bind(("", 8889)); sender.settimeout(15)
def order(text):
    sender.sendto(text.encode(), drone)
    return sender.recv(1024).decode(errors="replace").strip()
def height():
    fields = dict(pair.split(":") for pair in state.recv(1024).decode().strip().strip(";").split(";"))
    return int(fields["h"])
print("command", order("command")); print("takeoff", order("takeoff"))
state.close(); state = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); state.bind(("", 8890)); state.settimeout(5)
print("height", height()); print("land", order("land"))
"""


def test_a_simulated_tello_in_one_container_is_flown_from_another(built):
    network = tello = "flockwire-test-tello"
    run("docker", "network", "create", "--internal", network)
    try:
        line = ["docker", "run", "-d", "--name", tello, "--network", network, "--network-alias", "tello", OPERATOR]
        run(*line, "tello-sim", "--address", "0.0.0.0")
        until(lambda: "simulated Tello" in run("docker", "logs", tello).stdout, 20, "a simulated Tello")
        client = ["docker", "run", "--rm", "--network", network, "--entrypoint", "python", IMAGE, "-c", TELLO_CLIENT]
        said = run(*client, "tello", timeout=60).stdout.splitlines()
        assert said[:2] == ["command ok", "takeoff ok"]
        assert int(said[2].split()[1]) > 30  # cm
        assert said[3] == "land ok"
    finally:
        run("docker", "rm", "-f", tello, check=False)
        run("docker", "network", "rm", network, check=False)

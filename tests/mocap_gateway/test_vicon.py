"""The Vicon source with a stand-in for its child process: the package needs a server of the vendor's."""

import asyncio
import json
import sys

import pytest
from flockwire_mocap import extras
from flockwire_mocap.core import make_core
from flockwire_mocap.vicon.client import ViconClient
from flockwire_mocap.vicon.source import MOST_BODIES

NOW = 5


def line(**bodies):
    return json.dumps(bodies).encode()


def test_frames_are_lines_and_lost_bodies_say_nothing(start):
    core = make_core(start(source="vicon"))
    core.source.line(line(uav1=[1, 2, 3, 0, 0, 0.6, 0.8], uav2=[float("nan")] * 7), NOW)
    (frame,) = core.source.take(NOW)
    assert [(body.name, body.tracked) for body in frame.bodies] == [("uav1", True), ("uav2", False)]
    assert frame.bodies[0].position == (1.0, 2.0, 3.0)
    assert core.source.link(NOW) == ("", ())


def test_frames_count_up_by_one(start):
    source, numbers = make_core(start(source="vicon")).source, []
    for now in (1, 2, 3):
        source.line(line(uav1=[1, 2, 3, 0, 0, 0.6, 0.8]), now)
        numbers += [frame.number for frame in source.take(now)]
    assert numbers == [0, 1, 2]


@pytest.mark.parametrize("bad", [b"", b"{", b"[1]", b'{"uav1": [1]}', b'{"uav1": 1}', b'{"uav1": ["x"]}', b"\xff"])
def test_a_malformed_line_is_counted(start, bad):
    source = make_core(start(source="vicon")).source
    source.line(bad, NOW)
    assert source.link(NOW).counts == (("lines malformed", 1),)


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("import time; time.sleep(60)", "sends nothing"),
        ("print('\"no route\"', flush=True)", "no route"),
        ("", "the client has ended"),
    ],
)
def test_a_child_that_hangs_or_ends_is_a_line_and_started_again(start, script, said, monkeypatch):
    monkeypatch.setattr("flockwire_mocap.vicon.client.PATIENCE", 0.5)
    source = make_core(start(source="vicon")).source

    async def run():
        client = ViconClient(source, lambda: None, [sys.executable, "-c", script])
        client.open()
        async with asyncio.timeout(5.0):
            while said not in source.failure:  # noqa: ASYNC110 a child reports to no event
                await asyncio.sleep(0.02)
        await client.close()

    asyncio.run(run())


def test_a_frame_of_very_many_bodies_is_read(start, tmp_path):
    source, taken = make_core(start(source="vicon")).source, []
    sent = line(**{f"a body with a name of some length {k}": [1.0 / 3.0] * 3 + [0.5] * 4 for k in range(MOST_BODIES)})
    assert len(sent) > 64 * 1024  # which asyncio takes by default
    path = tmp_path / "frame"
    path.write_bytes(sent + b"\n")
    script = f"import time; print(open({str(path)!r}).read(), end='', flush=True); time.sleep(60)"

    async def run():
        client = ViconClient(source, lambda: taken.extend(source.take(NOW)), [sys.executable, "-c", script])
        client.open()
        async with asyncio.timeout(5.0):
            while not taken:  # noqa: ASYNC110 a child reports to no event
                await asyncio.sleep(0.02)
        await client.close()

    asyncio.run(run())
    assert len(taken[0].bodies) == MOST_BODIES


def test_a_child_that_cannot_be_started_is_a_line(start):
    source = make_core(start(source="vicon")).source

    async def run():
        client = ViconClient(source, lambda: None, ["/no/such/program"])
        client.open()
        async with asyncio.timeout(5.0):
            while "No such file" not in source.failure:  # noqa: ASYNC110 it reports to no event
                await asyncio.sleep(0.02)
        await client.close()

    asyncio.run(run())


@pytest.mark.parametrize("extra", ["vicon", "qualisys"])
def test_a_missing_package_is_named_with_the_command_that_installs_it(extra):
    with pytest.raises(extras.MissingExtraError) as missing:
        extras.imported("no_such_package", extra)
    assert f"pip install 'flockwire[{extra}]'" in str(missing.value)

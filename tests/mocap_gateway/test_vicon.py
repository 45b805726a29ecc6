"""The Vicon source with a stand-in for its child process: the package needs a server of the vendor's."""

import asyncio
import json
import re
import sys
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from flockwire_core.extras import remedy
from flockwire_mocap import vicon
from flockwire_mocap.core import make_core
from flockwire_mocap.persistent import imported
from flockwire_mocap.vicon import MOST_BODIES, ViconClient
from waiting import until

NOW = 5


def line(came=1_000_000_000, /, **bodies):
    return json.dumps([came, bodies]).encode()


def test_frames_are_lines_and_lost_bodies_say_nothing(start):
    core = make_core(start(source="vicon"))
    core.source.line(line(uav1=[1, 2, 3, 0, 0, 0.6, 0.8], uav2=[float("nan")] * 7), NOW)
    (frame,) = core.source.take(NOW)
    assert [(body.name, body.tracked) for body in frame.bodies] == [("uav1", True), ("uav2", False)]
    assert frame.bodies[0].position == (1.0, 2.0, 3.0)
    assert core.source.state(NOW) == ("", ())


def test_frames_count_up_by_one(start):
    source, numbers = make_core(start(source="vicon")).source, []
    for now in (1, 2, 3):
        source.line(line(now, uav1=[1, 2, 3, 0, 0, 0.6, 0.8]), now)
        numbers += [frame.number for frame in source.take(now)]
    assert numbers == [0, 1, 2]


@pytest.mark.parametrize(
    "bad",
    [
        b"", b"{", b"[1]", b"[1, 2, 3]", b"{}", b"1", b"\xff", b'[1, {"uav1": [1]}]', b'[1, {"uav1": 1}]',
        b'[1, {"uav1": ["x"]}]', b'["x", {}]', b"[1.5, {}]", b"[true, {}]", b"[-1, {}]", b"[Infinity, {}]",
        b"[1" + b"0" * 400 + b", {}]",
    ],
)  # fmt: skip
def test_a_malformed_line_is_counted(start, bad):
    source = make_core(start(source="vicon")).source
    source.line(bad, NOW)
    assert source.state(NOW).counts == (("lines malformed", 1),)


def test_a_frame_that_waited_to_be_read_is_as_old_as_it_is(start):
    source, second, began = make_core(start(source="vicon")).source, 1_000_000_000, 1_790_000_000 * 1_000_000_000
    ages = []
    for frame in range(60):  # one each 10 ms; from 0.3 s on nobody reads for 0.3 s, then all that waits at once
        came = frame * second // 100
        read = began + (60 * second // 100 if frame >= 30 else came)
        source.line(line(came, uav1=[1, 2, 3, 0, 0, 0.6, 0.8]), read)
        ages += [(read - taken.captured) / second for taken in source.take(read)]
    assert ages[:30] == [0.0] * 30
    assert ages[30:] == pytest.approx([0.3 - 0.01 * k for k in range(30)])


def test_the_child_stamps_a_frame_at_arrival(monkeypatch, capsys):
    body = SimpleNamespace(position=(1.0, 2.0, 3.0), rotation=SimpleNamespace(x=0, y=0, z=0, w=1))
    waits = Mock(side_effect=(None, None, BrokenPipeError))  # two frames, then the parent is gone
    times, system = iter((70, 80)), SimpleNamespace(rigidBodies={"uav1": body}, waitForNextFrame=waits)
    monkeypatch.setattr(vicon, "imported", lambda *_: SimpleNamespace(connect=lambda *_: system))
    monkeypatch.setattr(vicon.clock, "monotonic", lambda: next(times))
    monkeypatch.setattr("sys.argv", ["child", "server"])
    assert vicon.main() == 0
    frames = [json.loads(text) for text in capsys.readouterr().out.splitlines()]
    assert frames == [[70, {"uav1": [1.0, 2.0, 3.0, 0, 0, 0, 1]}], [80, {"uav1": [1.0, 2.0, 3.0, 0, 0, 0, 1]}]]


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("import time; time.sleep(60)", "sends nothing"),
        ("print('\"no route\"', flush=True)", "no route"),
        ("", "the client has ended"),
    ],
)
def test_a_child_that_hangs_or_ends_is_reported_and_restarted(start, script, said, monkeypatch, tmp_path):
    monkeypatch.setattr("flockwire_mocap.vicon.FRAME_TIMEOUT", 0.5)
    monkeypatch.setattr(ViconClient, "PAUSE", 0.01)
    source, begun = make_core(start(source="vicon")).source, tmp_path / "begun"
    script = f"open({str(begun)!r}, 'a').write('.'); {script}"

    async def run():
        client = ViconClient(source, lambda: None, [sys.executable, "-c", script])
        async with client:
            await until(lambda: begun.exists() and begun.read_text().startswith(".."))

    asyncio.run(run())
    assert said in source.failure


def test_a_frame_of_very_many_bodies_is_read(start, tmp_path):
    source, taken = make_core(start(source="vicon")).source, []
    sent = line(**{f"a body with a name of some length {k}": [1.0 / 3.0] * 3 + [0.5] * 4 for k in range(MOST_BODIES)})
    assert len(sent) > 64 * 1024  # which asyncio takes by default
    path = tmp_path / "frame"
    path.write_bytes(sent + b"\n")
    script = f"import time; print(open({str(path)!r}).read(), end='', flush=True); time.sleep(60)"

    async def run():
        client = ViconClient(source, lambda: taken.extend(source.take(NOW)), [sys.executable, "-c", script])
        async with client:
            await until(lambda: taken)

    asyncio.run(run())
    assert len(taken[0].bodies) == MOST_BODIES


def test_a_child_that_cannot_be_started_is_a_line(start):
    source = make_core(start(source="vicon")).source

    async def run():
        client = ViconClient(source, lambda: None, ["/no/such/program"])
        async with client:
            await until(lambda: "No such file" in source.failure)

    asyncio.run(run())
    assert source.failure.startswith("the connection failed")


@pytest.mark.parametrize("extra", ["vicon", "qualisys"])
def test_a_missing_package_is_named_with_the_command_that_installs_it(extra):
    with pytest.raises(OSError, match=re.escape(remedy(extra))):
        imported("no_such_package", extra)

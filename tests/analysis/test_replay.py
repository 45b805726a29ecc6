"""The replay page: the flight in it is that of the trace, in one file, within its size."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import refused
from flockwire_analysis import replay as replaying
from flockwire_analysis.key_figures import Check
from flockwire_analysis.observed import MOST_REASONED, TOO_MANY, Shown, append_change, shown
from flockwire_analysis.reading import read_trace
from flockwire_analysis.replay import SILENT, flight_data, replay, reports
from flockwire_analysis.sampled import sampled, worst_moments
from flockwire_analysis.summary import summarise
from flockwire_analysis.tracking import places, references
from flockwire_analysis.view import FOLDER
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Reason
from page_reader import Hostile

LARGEST = 10_000_000  # bytes: the bound of the issue for 60 s of five drones


@pytest.fixture(scope="module")
def trace(tmp_path_factory, write_flight):
    path = tmp_path_factory.mktemp("replay") / "trace.mcap"
    write_flight(path, begin=-2.0, end=8.0, holds_at=5.0, resumes_at=6.0, pilot_ends_at=5.0)
    return read_trace(path)


@pytest.fixture(scope="module")
def data(trace):
    return json.loads(json.dumps(flight_data(trace)))


def stamps_of(data):
    return data["zero"] * 10**6 + np.rint((data["begin"] + data["step"] * np.arange(data["count"])) * SECOND).astype(
        np.int64
    )


def test_the_positions_in_the_page_are_those_of_the_trace_to_a_millimetre(trace, data):
    stamps = stamps_of(data)
    assert data["step"] == pytest.approx(0.02)
    for number, drone in data["drones"].items():
        for found, wanted in (("position", places), ("place", references)):
            expected = 1000.0 * wanted(trace, int(number), stamps)
            sent = np.array(drone[found], dtype=float).T  # null: NaN
            assert (np.isnan(sent) == np.isnan(expected)).all()
            assert np.nanmax(np.abs(sent - expected), initial=0.0) <= 0.51
    assert np.isfinite(np.array(data["drones"]["1"]["place"], dtype=float)).any()


def test_orders_and_phases_are_marked_at_their_times(data):
    orders = [(mark["t"], mark["text"]) for mark in data["marks"] if mark["kind"] == "order"]
    assert orders == [(-1.9, "takeoff"), (0.0, "start"), (5.0, "hold"), (6.0, "start"), (8.0, "land")]
    phases = [mark["text"] for mark in data["marks"] if mark["kind"] == "phase"]
    assert "leader, uav1, uav2, uav3, uav4: formation" in phases  # together, once
    assert [mark["text"] for mark in data["marks"] if mark["kind"] == "rung"] == ["uav4: silent"]


def test_a_process_that_reports_no_more_is_silent(trace, data):
    assert [one.phase for one in reports(trace, "uav4")][-1] == SILENT
    assert [one.phase for one in reports(trace, "uav1")][-1] != SILENT
    silent = [change for change in data["drones"]["4"]["reports"] if change[1] == SILENT]
    assert silent[0][0] == pytest.approx(7.0, abs=0.1)  # 2 s after its last status


def test_a_status_that_comes_again_ends_the_silence(tmp_path, write_flight):
    write_flight(tmp_path / "trace.mcap", begin=-1.0, end=5.0, unrecorded=(1.0, 4.0))
    found = [one.phase for one in reports(read_trace(tmp_path / "trace.mcap"), "uav1")]
    assert found[found.index(SILENT) - 1] == found[found.index(SILENT) + 1] == "formation"


def test_a_process_whose_stamps_go_back_has_its_changes_in_order(trace):
    key, (begin, end) = Key("status", "uav1"), (trace.begin, trace.begin + 90 * SECOND)
    stamps = begin + SECOND * np.array([10, 50, 80])
    columns = dict.fromkeys(("stamps", "published", "logged", "sequences"), stamps)
    series = replace(trace.series[key], **columns, values=np.empty((3, 0)))
    told = (Shown(int(stamps[2]), "hold"), Shown(int(stamps[1]), "landing"))  # as they arrived
    odd = replace(trace, series={**trace.series, key: series}, shown={"uav1": told}, end=end)
    found = [((one.stamp - begin) // SECOND, one.phase) for one in reports(odd, "uav1")]
    assert found == [(12, SILENT), (50, "landing"), (52, SILENT), (80, "hold"), (82, SILENT)]
    forged = replace(odd, shown={"uav1": told[:1]})
    found = [((one.stamp - begin) // SECOND, one.phase) for one in reports(forged, "uav1")]
    assert found == [(12, SILENT), (50, "hold"), (52, SILENT), (80, "hold"), (82, SILENT)]


def test_a_process_that_changes_its_reasons_at_each_status_does_not_fill_the_page(trace):
    history, status = [], next(one.last for one in trace.vitals if one.last.identity == "uav1")
    for k in range(2 * MOST_REASONED):
        report = status.report._replace(detail=f"{k} ".ljust(256, "x"), reasons=8 * (Reason("code", 256 * "y"),))
        append_change(history, shown(status._replace(stamp=k, report=report)))
    assert len(history) == MOST_REASONED + 1
    assert history[-2].why.startswith(f"{MOST_REASONED - 1} x")
    assert history[-1][1:3] == (status.report.phase, TOO_MANY)
    assert sum(len(one.why) for one in history) < LARGEST / 4


def test_the_worst_moments_are_those_of_the_samples(trace):
    flight = sampled(trace, 10**6)
    moments = list(worst_moments(flight))
    kinds = [re.split(r":", moment.text)[0] for moment in moments]
    assert kinds == [
        "distance between drones",
        "distance to an obstacle",
        "formation error in a tail",
        "observation error in a tail",
    ]
    one, other = moments[0].drones
    apart = np.linalg.norm(flight.positions[one] - flight.positions[other], axis=1)
    assert flight.stamps[np.nanargmin(apart)] == moments[0].stamp
    assert f"{np.nanmin(apart):.2f} m" in moments[0].text


def test_a_page_of_a_minute_is_within_its_size_and_a_longer_one_has_fewer_samples(trace, monkeypatch):
    page = replay(trace, summarise(trace))
    lasts = (trace.end - trace.begin) / SECOND
    scripts = sum(path.stat().st_size for path in FOLDER.iterdir() if path.is_file())
    assert scripts + (len(page) - scripts) * 60.0 / lasts < LARGEST
    monkeypatch.setattr(replaying, "MOST", 4000)
    short = flight_data(trace)
    assert short["count"] == pytest.approx(4000 / 8 / 5, abs=2)
    assert short["begin"] + short["count"] * short["step"] >= (trace.end - trace.begin) / SECOND - 2.1


def test_the_page_needs_nothing_else_and_hostile_text_never_becomes_markup(trace):
    hostile = Hostile()
    named = replace(trace, plan=Plan(trace.swarm.model_copy(update={"name": hostile("swarm")})))
    check = Check(hostile("check"), None, None, False, hostile("rule"), reason=hostile("reason"))
    shown = {name: tuple(one._replace(why=hostile(name)) for one in all_) for name, all_ in trace.shown.items()}
    page = replay(replace(named, shown=shown), replace(summarise(trace), checks=(check,)))
    assert "://" not in page.replace("http://www.w3.org", "")
    assert page.count("<script") == 2
    assert "<script>alert" not in page
    embedded = re.search(r'<script id="flight" type="application/json">(.*?)</script>', page, re.DOTALL)[1]
    sent = json.loads(embedded)
    assert sent["verdict"] == "1 of 1 checks failed"
    assert sent["outline"]["name"] == hostile.texts[0]


def test_a_trace_without_positions_or_orders_has_a_page(tmp_path, write_flight):
    write_flight(tmp_path / "trace.mcap", begin=-0.3, end=0.1, started=False, lands=False)
    trace = read_trace(tmp_path / "trace.mcap")
    empty = replace(trace, series={})
    assert flight_data(empty)["drones"][1]["position"][0][0] is None
    assert "checks failed" in replay(empty, summarise(trace))


@pytest.mark.parametrize("late", [-0.01, 1.99, 2.0, 60.0])
def test_orders_later_than_the_last_message_show_the_end_of_the_trace(trace, late):
    shift = trace.end + round(late * SECOND) - trace.missions[0].stamp
    later = [mission._replace(stamp=mission.stamp + shift) for mission in trace.missions]
    data = flight_data(replace(trace, missions=tuple(later)))
    assert data["count"] == pytest.approx(2.0 / data["step"], abs=1 if late >= 0.0 else 2)
    end = data["begin"] + (data["count"] - 1) * data["step"]
    assert data["zero"] / 1000 + end == pytest.approx(trace.end / SECOND, abs=0.03)


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_the_grid_has_few_lines_however_far_away_a_drone_reports_to_be():
    scripts = "".join((FOLDER / name).read_text() for name in ("camera.js", "scene.js", "chart.js"))
    lines = """
        Camera.prototype.listen = () => {};
        const scene = new Scene({}, () => {});
        scene.begin({ heights: [0, 3], fence: [[0, 0], [9, 0], [9, 9], [0, 9]] });
        const palette = { line: "", muted: "" };
        let lines = 0;
        shape = scene.rule = () => { lines += 1; };
        const pen = new Proxy({}, { get: () => () => {}, set: () => true });
        const found = [];
        for (const view of ["above", "side", "3-D"]) {
          for (const far of [4, 300, 1e4, 1e9, 1e300]) {
            for (const scale of [null, 1, 4000]) {
              scene.camera.look(view);
              Object.assign(scene.camera, { width: 1200, height: 800, covered: 0, middle: 400 });
              [scene.camera.right, scene.camera.up, scene.camera.near] = scene.camera.axes();
              scene.camera.frame([[0, 0, 1], [far, 1, 1]]);
              if (scale) scene.camera.scale = scale;
              lines = 0;
              scene.grid(pen);
              found.push(lines);
            }
          }
        }
        console.log(JSON.stringify(found));
    """
    run = subprocess.run(
        ["node", "-e", scripts + "let shape;" + lines], check=True, capture_output=True, text=True, timeout=60
    )
    counts = json.loads(run.stdout)
    assert max(counts) < 500
    assert counts[0] > 5


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
@pytest.mark.parametrize("script", sorted(FOLDER.glob("*.js")), ids=lambda path: path.name)
def test_the_scripts_are_javascript(script):
    assert subprocess.run(["node", "--check", script], check=False).returncode == 0


def test_the_command_writes_the_page_beside_the_trace(flockwire, tmp_path, write_flight):
    write_flight(tmp_path / "trace.mcap", begin=-0.3, end=0.5)
    assert flockwire("view", tmp_path / "trace.mcap").returncode == 0
    assert (tmp_path / "replay.html").exists()
    assert "must end with .html" in refused(flockwire("view", tmp_path / "trace.mcap", "--out", tmp_path / "page.txt"))


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disk_is_said_with_the_page(flockwire, tmp_path, write_flight):
    write_flight(tmp_path / "trace.mcap", begin=-0.3, end=0.5)
    (tmp_path / "page.html").symlink_to("/dev/full")
    done = flockwire("view", tmp_path / "trace.mcap", "--out", tmp_path / "page.html")
    assert done.returncode == 2
    assert f"flockwire: {tmp_path}/page.html: No space left on device" in done.stderr

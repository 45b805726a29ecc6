"""A trace as tables holds what the trace holds."""

import csv

import numpy as np
import pytest
from flockwire_analysis.collecting import Collector
from flockwire_analysis.export import tables, write_csv, write_parquet
from flockwire_analysis.reading import read_trace
from flockwire_analysis.summary import summarise
from flockwire_core.domain.airframe import Command
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import Key
from pyarrow import parquet


@pytest.fixture(scope="module")
def exported(good_flight, tmp_path_factory):
    trace, out = read_trace(good_flight), tmp_path_factory.mktemp("tables")
    return trace, {path.stem: path for path in write_csv(trace, out)}


def test_every_row_of_a_topic_is_a_row_of_its_table(exported):
    trace, files = exported
    with files["estimate"].open() as file:
        rows = [row for row in csv.DictReader(file) if row["drone"] == "uav2"]
    series = trace.of("estimate", 2)
    assert [int(row["stamp_ns"]) for row in rows] == series.stamps.tolist()
    assert np.array([[float(row[c]) for c in ("x_m", "y_m", "z_m")] for row in rows]) == pytest.approx(
        series.values[:, :3]
    )


def test_a_table_of_poses_has_the_orientation(make_swarm, tmp_path):
    swarm = make_swarm()
    collector, key = Collector(swarm, {}), Key("pose", "uav1")
    turned = [(0.0, 0.0, 0.6, 0.8), (0.0, 0.0, -0.6, 0.8)]
    for number, orientation in enumerate(turned):  # the newer one first
        stamp = SECOND * (2 - number)
        collector.add("gateway", key, Pose(stamp, "world", (1.0, 2.0, 3.0), orientation), number, stamp, stamp)
    table = dict(tables(collector.trace(tmp_path)))["pose"]
    found = list(zip(*(table[name] for name in ("qx", "qy", "qz", "qw")), strict=True))
    assert found == turned[::-1]
    assert (table["x_m"], table["z_m"]) == ([1.0, 1.0], [3.0, 3.0])


def test_a_table_of_commands_has_the_acceleration(make_swarm, tmp_path):
    collector = Collector(make_swarm(), {})
    command = Command(SECOND, "world", (0.1, 0.2, 0.3), 0.0, (1.0, 2.0, 3.0))
    collector.add("uav1", Key("command", "uav1"), command, 0, SECOND, SECOND)
    table = dict(tables(collector.trace(tmp_path)))["command"]
    assert [table[name] for name in ("vx_m_s", "vz_m_s", "ax_m_s2", "ay_m_s2", "az_m_s2")] == [
        [0.1], [0.3], [1.0], [2.0], [3.0]
    ]  # fmt: skip


def test_time_counts_from_the_formation(exported):
    _, files = exported
    with files["events"].open() as file:
        events = {row["event"]: float(row["t_s"]) for row in csv.DictReader(file)}
    assert events["start"] == 0.0
    assert events["land"] > 0.0


def test_figures_made_of_a_table_agree_with_the_summary(exported):
    trace, files = exported
    with files["formation_error"].open() as file:
        rows = [(int(row["phase"]), int(row["in_tail"]), float(row["error_m"])) for row in csv.DictReader(file)]
    assert {phase for phase, _, _ in rows} == {0, 1}  # 0 in the landing
    assert max(error for phase, tail, error in rows if phase == 1 and tail) == pytest.approx(
        summarise(trace).formation_error_m.max_tail
    )


def test_parquet_has_the_same_tables(exported, tmp_path):
    trace, files = exported
    written = {path.stem: parquet.read_table(path) for path in write_parquet(trace, tmp_path)}
    assert written.keys() == files.keys()
    for name, table in written.items():
        with files[name].open() as file:
            header, *rows = csv.reader(file)
        assert (table.column_names, table.num_rows) == (header, len(rows))

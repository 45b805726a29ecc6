"""A trace as tables holds what the trace holds."""

import csv

import numpy as np
import pytest
from flockwire_recorder.export import write_csv, write_parquet
from flockwire_recorder.reading import read_trace
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


def test_time_counts_from_the_formation(exported):
    _, files = exported
    with files["events"].open() as file:
        events = {row["event"]: float(row["t_s"]) for row in csv.DictReader(file)}
    assert events["start"] == 0.0
    assert events["land"] > 0.0


def test_parquet_has_the_same_tables(exported, tmp_path):
    trace, files = exported
    written = {path.stem: parquet.read_table(path) for path in write_parquet(trace, tmp_path)}
    assert written.keys() == files.keys()
    for name, table in written.items():
        with files[name].open() as file:
            header, *rows = csv.reader(file)
        assert (table.column_names, table.num_rows) == (header, len(rows))

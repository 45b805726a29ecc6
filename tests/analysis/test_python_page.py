"""The examples of docs/python.md, run on a flight."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest
from flockwire.analysis import open_trace, read_trace, summarise

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/python.md").read_text(encoding="utf-8")


def test_the_documented_script_prints_checks_and_errors(good_flight, example, tmp_path):
    script = tmp_path / "errors.py"
    script.write_text(example("python", "python"), encoding="utf-8")
    line = [sys.executable, script, good_flight]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert any(one.startswith("ok  ") for one in lines)
    assert next(one.partition(":")[0] for one in lines if one.startswith("uav")) == "uav1"


@pytest.fixture(params=["pandas", "numpy"])
def without_or_with_pandas(request, monkeypatch):
    """Let pandas seem absent, or not."""
    if request.param == "numpy":
        monkeypatch.setattr("flockwire_analysis.export.find_spec", lambda name: None)
    return request.param


def test_the_tables_give_each_follower_s_largest_error(good_flight, without_or_with_pandas, capsys):
    (code,) = (block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "open_trace" in block)
    exec(code.replace("runs/first/trace.mcap", str(good_flight)), {})
    printed = capsys.readouterr().out
    tables = open_trace(good_flight)
    rows = dict(re.findall(r"^\| (`\w+`(?:, `\w+`)*) \| (.*) \|$", PAGE.partition("## Tables")[2], re.MULTILINE))
    for name, table in tables.items():  # the page has every table and column
        (columns,) = (text for names, text in rows.items() if f"`{name}`" in names)
        assert all(f"`{column}`" in columns for column in set(table) - {"t_s", "stamp_ns", "drone"}), name
    kind = pandas.DataFrame if without_or_with_pandas == "pandas" else dict
    assert all(isinstance(table, kind) for table in tables.values())
    hidden = [(name, column) for name, table in tables.items() for column in table if hasattr(pandas.DataFrame, column)]
    assert hidden == []  # table.tail would be a method
    errors = tables["formation_error"]
    for drone in ("uav1", "uav4"):
        assert re.search(rf"^{drone} 3\.\d+$", printed, re.MULTILINE)
    judged = np.asarray(errors["error_m"])[(np.asarray(errors["phase"]) == 1) & (np.asarray(errors["in_tail"]) == 1)]
    assert judged.max() == pytest.approx(summarise(read_trace(good_flight)).formation_error_m.max_tail)


def test_a_trace_is_opened_by_its_path_as_text(good_flight):
    assert read_trace(str(good_flight)).swarm == read_trace(good_flight).swarm
    with pytest.raises(FileNotFoundError, match="nothing"):
        read_trace("nothing.mcap")


@pytest.mark.long
def test_the_notebook_of_the_examples_runs(good_flight, tmp_path):
    notebook = json.loads((ROOT / "examples/paper/flight.ipynb").read_text(encoding="utf-8"))
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert not [cell for cell in notebook["cells"] if cell.get("outputs")]
    (tmp_path / "runs/flight").mkdir(parents=True)
    (tmp_path / "runs/flight/trace.mcap").symlink_to(good_flight)
    line = [sys.executable, "-c", "\n".join(cells)]
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "ok   separation" in done.stdout
    assert len(re.findall(r"^uav[1-4]: [\d.]+ mm at most, [\d.]+ mm rms$", done.stdout, re.MULTILINE)) == 4
    assert len(re.findall(r"^\(\d, \d\) [\d.]+ m$", done.stdout, re.MULTILINE)) == 3

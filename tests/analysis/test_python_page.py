"""The example of docs/python.md, run on a flight."""

import subprocess
import sys


def test_the_documented_script_prints_checks_and_errors(good_flight, example, tmp_path):
    script = tmp_path / "errors.py"
    script.write_text(example("python", "python"), encoding="utf-8")
    line = [sys.executable, script, good_flight]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert any(one.startswith("ok  ") for one in lines)
    assert next(one.partition(":")[0] for one in lines if one.startswith("uav")) == "uav1"

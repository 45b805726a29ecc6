import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).parents[2] / "lab/bench" / "tracker_fuzz.py"


def test_mutated_packets_raise_nothing():
    done = subprocess.run([sys.executable, FUZZ, "20000", "--seed", "7"], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("no exception") == 3

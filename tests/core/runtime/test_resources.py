import subprocess
import sys

import pytest
from flockwire_core.runtime.resources import peak_memory

PEAK = "from flockwire_core.runtime.resources import peak_memory; print(peak_memory())"


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone passes a parent's peak on")
def test_a_process_s_memory_is_not_that_of_who_started_it():
    held = bytearray(300 << 20)
    held[:: 1 << 12] = b"x" * (len(held) >> 12)  # resident, each page
    started = subprocess.run([sys.executable, "-c", PEAK], capture_output=True, text=True, check=True)
    assert peak_memory() >= len(held)
    assert 1 << 20 < int(started.stdout) < len(held)

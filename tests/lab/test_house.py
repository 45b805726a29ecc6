"""The count of the house."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.long
@pytest.mark.sources
def test_the_house_is_counted() -> None:
    table = subprocess.check_output([sys.executable, ROOT / "lab/house.py"], text=True)
    assert "functions of complexity > 10" in table

"""A trace's tables for one's own evaluation: pandas where it is installed, numpy otherwise."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from flockwire_analysis.export import tables
from flockwire_analysis.reading import read_trace


def open_trace(path: str | Path) -> dict[str, Any]:
    """Return the tables of a trace by name, those that `write_csv` writes.

    Each is a pandas.DataFrame if pandas is installed, else a dict of numpy arrays, one for each column. Either way
    `open_trace(path)["formation_error"]["error_m"]` is a column. Raises ValueError for a file that is not the trace of
    a swarm, OSError for one that cannot be read.
    """
    found = dict(tables(read_trace(Path(path))))
    if find_spec("pandas") is None:
        return {name: {key: np.array(column) for key, column in table.items()} for name, table in found.items()}
    frame = import_module("pandas").DataFrame
    return {name: frame(table) for name, table in found.items()}

"""Recorded flights: reading a trace, its figures and checks, errors over time, report and tables.

A public interface (docs/python.md). Needs the extra `station`; `write_report` needs `report` too. Stamps are Unix ns,
lengths m, world frame ENU.
"""

from flockwire_analysis.export import ExportError, open_trace, write_csv, write_parquet
from flockwire_analysis.key_figures import Check, Summary
from flockwire_analysis.reading import read_trace
from flockwire_analysis.recorded import Trace
from flockwire_analysis.report import write_report
from flockwire_analysis.summary import summarise
from flockwire_analysis.tracking import Errors, formation_errors, observation_errors

__all__ = [
    "Check", "Errors", "ExportError", "Summary", "Trace", "formation_errors", "observation_errors", "open_trace",
    "read_trace", "summarise", "write_csv", "write_parquet", "write_report",
]  # fmt: skip

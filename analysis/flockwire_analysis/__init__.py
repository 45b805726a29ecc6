"""Analysis of a trace: reading, checks, summary, figures, report, export, comparison."""

"""Analysis of a trace: reading, checks, summary, figures, report, export, comparison."""

FAULTS = "faults"  # of a trace's metadata: [s after the take-off order, in words] of each injected one

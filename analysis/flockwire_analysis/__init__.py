"""What is known of a flight from its trace: reading, checks, summary, figures, report, export, comparison."""

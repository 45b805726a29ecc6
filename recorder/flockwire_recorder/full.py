"""The error of a trace that takes no more; apart from the trace, which is compiled: an error cannot be."""


class TraceFullError(OSError):
    """Nothing more can be written: the disk is full, or gone."""

    def __str__(self) -> str:
        return f"{self.filename}: {self.strerror}"

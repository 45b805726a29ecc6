"""The error of a full disk; apart from the trace, because an OSError cannot be compiled."""


class TraceFullError(OSError):
    """Nothing more can be written: the disk is full, or gone."""

    def __str__(self) -> str:
        return f"{self.filename}: {self.strerror}"

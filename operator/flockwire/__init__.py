"""flockwire: formation flight with one process per drone. What programs of users import (docs/python.md)."""

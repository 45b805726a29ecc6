"""The control mathematics: pure functions of numbers, no clock, no input or output."""

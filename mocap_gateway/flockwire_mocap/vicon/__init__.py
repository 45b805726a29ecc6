"""Vicon by the package `motioncapture`, in a child process: its connect may hold the interpreter for ever."""

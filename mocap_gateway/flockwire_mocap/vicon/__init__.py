"""Vicon by the package `motioncapture`, in a child process, because its connect may block the interpreter."""

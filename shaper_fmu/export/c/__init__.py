"""Translation of kernels, written in a subset of Python, to C99 that one can read; see docs/c.md."""

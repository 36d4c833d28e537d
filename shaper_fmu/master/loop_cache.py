"""Selects the folder in which numba keeps the compiled loop: beside the sources, in the user's cache, or a temporary one."""

from __future__ import annotations

import sys

import numba
from numba.core import config

from shaper_fmu.private_folder import private_folder


def _probe() -> None:
    """Something to be cached."""


def _caches() -> bool:
    """Whether compiled code can be kept; numba gets a folder if it has none itself."""
    why = "compiled code can be kept neither beside shaper-fmu nor in the user's cache folder (NUMBA_CACHE_DIR names another)"
    if config.CACHE_DIR:  # pyright: ignore[reportAttributeAccessIssue]
        why = f"compiled code cannot be kept in {config.CACHE_DIR}: NUMBA_CACHE_DIR cannot be written to"  # pyright: ignore[reportAttributeAccessIssue]
    for _ in range(2):
        try:
            numba.njit(cache=True)(_probe)
            return True
        except (RuntimeError, OSError):  # "no locator available"
            folder = private_folder("shaper-fmu-numba", why)
            if folder is None:
                break
            config.CACHE_DIR = str(folder)  # pyright: ignore[reportAttributeAccessIssue]
    if sys.stderr is not None:
        print(f"note: {why}: the loop is compiled anew each time, which takes about a minute", file=sys.stderr)
    return False


CACHES = _caches()

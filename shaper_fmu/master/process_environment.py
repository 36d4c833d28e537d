"""Environment variables that FMUs change: kept while the FMUs run, since their libraries may read them, and restored at the end."""

from __future__ import annotations

import ctypes
import itertools
import os
import sys
import time

_left: dict[bytes, tuple[bytes | None, bytes | None]] = {}
"""By name: the value that was found, and that of an FMU, which was left; None for none."""


_place = ctypes.c_void_p.in_dll(ctypes.CDLL(None), "environ") if sys.platform == "linux" else ctypes.c_void_p()
_known: tuple[int, bytes, dict[bytes, bytes]] = 0, b"", {}
"""Where C's array of entries was when it was last read, its addresses, and their content: reading them all takes a while."""


def _variables() -> dict[bytes, bytes]:
    """The environment variables of C; Python's os.environ knows only those that Python sets."""
    global _known
    if sys.platform != "linux":
        return {os.fsencode(name): os.fsencode(value) for name, value in os.environ.items()}
    array = _place.value or 0
    known_array, known_addresses, variables = _known
    if array and array == known_array and ctypes.string_at(array, len(known_addresses)) == known_addresses:
        return variables
    addresses = ctypes.cast(array, ctypes.POINTER(ctypes.c_void_p))
    entries = list(itertools.takewhile(bool, (addresses[i] for i in itertools.count()))) if array else []
    pairs = [ctypes.string_at(entry).partition(b"=") for entry in entries if entry]
    variables = {name: value for name, equals, value in pairs if name and equals}
    _known = array, ctypes.string_at(array, ctypes.sizeof(ctypes.c_void_p) * (len(entries) + 1)) if array else b"", variables
    return variables


class Environment:
    """The environment variables."""

    label = "environment variables"

    def __init__(self) -> None:
        self._kept = _variables()

    def restore(self) -> bool:
        """Only remember what differs."""
        found = _variables()
        if found != self._kept:
            for name in found.keys() | self._kept.keys():
                if found.get(name) != self._kept.get(name):
                    original = _left[name][0] if name in _left else self._kept.get(name)
                    _left[name] = original, found.get(name)
            self._kept = found
        return False

    def close(self) -> None:
        """Nothing is held."""


def restore_environment() -> bool:
    """Restore what FMUs have changed, unless it was changed again since."""
    found, changed = _variables(), dict(_left)
    _left.clear()
    for name, (original, left) in changed.items():
        if found.get(name) != left or original == left:
            continue
        if original is None:
            os.unsetenv(name) if os.fsdecode(name) not in os.environ else os.environ.pop(os.fsdecode(name))
        else:
            os.environ[os.fsdecode(name)] = os.fsdecode(original)
    if b"TZ" in changed and hasattr(time, "tzset"):
        time.tzset()
    return bool(changed)

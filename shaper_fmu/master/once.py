"""FMUs that declare canBeInstantiatedOnlyOncePerProcess: a process has at most one instance, since all share variables.

That is one for each FMU, whatever its file is called: FMUs are the same where their GUID (FMI 3.0: instantiation token) and
their library's name are. An instance that cannot be freed stays; and a library that stays loaded when its instance is freed (as
some do, by a linker's option or for their C++ parts) may begin the next one with what the last one has left in global variables.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Mapping
from pathlib import Path

from shaper_fmu.errors import SimulationError
from shaper_fmu.master.fmu import Fmu

FLAG = "canBeInstantiatedOnlyOncePerProcess"
Key = tuple[str, str]

_there: dict[Key, str] = {}
"""The instances in this process, as texts, by FMU."""


class OccupiedError(SimulationError):
    """An FMU cannot be instantiated in this process, but in another one."""


def once_key(fmu: Fmu) -> Key | None:
    """The identity of an FMU that can be instantiated only once per process, otherwise None."""
    if not getattr(fmu.capabilities, FLAG, False):
        return None
    token = fmu.description.instantiationToken if fmu.version == 3 else fmu.description.guid
    return str(token), str(fmu.capabilities.modelIdentifier)


def once_problems(fmus: Mapping[str, Fmu]) -> list[str]:
    """Messages for instances of a system that cannot be in one process."""
    names: dict[Key, list[str]] = {}
    for name, fmu in fmus.items():
        key = once_key(fmu)
        if key is not None:
            names.setdefault(key, []).append(name)
    return [
        f"{', '.join(same[:-1])} and {same[-1]} are instances of the same FMU ({fmus[same[0]].name}), which says {FLAG}: in one "
        "process they would share its variables, so one system can have one of them; export the FMU without this limit"
        for same in names.values()
        if len(same) > 1
    ]


def occupy(name: str, fmu: Fmu, key: Key | None) -> None:
    """Enter the instance `name`. Raises OccupiedError if the process has, or may have, something of another one."""
    if key is None:
        return
    mine = f"its instance {name}, of a simulation that is not closed"
    there = _there.setdefault(key, mine)
    if there is not mine:
        raise OccupiedError(
            f"{name}: {fmu.name} says {FLAG}, and this process has {there}. Close simulations as soon as they are done "
            "(close(), or a with statement), or run this one in a separate process (isolate=True)"
        )


def vacate(name: str, key: Key | None, library: Path, freed: bool) -> None:
    """The instance is gone, and its library unloaded as far as it could be; or it could not be `freed`."""
    if key is None:
        return
    if not freed:
        _there[key] = f"its instance {name}, which failed beyond repair and cannot be freed"
    elif is_loaded(library):
        _there[key] = f"its library, which stays loaded after its instance {name} was freed, with its global variables"
    else:
        del _there[key]


def is_loaded(library: Path) -> bool:
    """Whether a library is loaded in this process."""
    if sys.platform == "win32":
        get_handle = ctypes.windll.kernel32.GetModuleHandleW
        get_handle.restype = ctypes.c_void_p
        return bool(get_handle(str(library)))
    here = ctypes.CDLL(None)
    here.dlopen.restype, here.dlopen.argtypes = ctypes.c_void_p, (ctypes.c_char_p, ctypes.c_int)
    here.dlclose.argtypes = (ctypes.c_void_p,)
    handle = here.dlopen(os.fsencode(library), os.RTLD_LAZY | os.RTLD_NOLOAD)
    if handle:
        here.dlclose(handle)
    return bool(handle)

"""The search path for modules of the processes that this one starts."""

from __future__ import annotations

import os
import sys
import sysconfig
from pathlib import Path

_NEEDED = ("shaper_fmu", "numpy", "msgspec")


def search_path() -> list[str]:
    """This process's module folders, reordered: the standard library first, then the folders of shaper-fmu and its dependencies.

    This process has loaded its modules already; in one that begins, a file such as random.py or numpy.py in the working
    folder, or beside a component, would be taken for the module.
    """
    library, archive = sysconfig.get_path("stdlib"), f"python{sys.version_info.major}{sys.version_info.minor}.zip"
    files = (getattr(sys.modules.get(name), "__file__", None) for name in _NEEDED)
    loaded_from = {str(Path(file).parents[1]) for file in files if file}

    def order(entry: str) -> int:
        if (entry.startswith(library) and "-packages" not in entry) or Path(entry).name == archive:
            return 0
        return 1 if entry in loaded_from else 2

    return sorted((entry or os.getcwd() for entry in sys.path), key=order)


def with_search_path(code: str) -> tuple[list[str], dict[str, str]]:
    """Command and environment of a process that looks there, and runs this code."""
    environment = dict(os.environ)
    own = environment.pop("PYTHONPATH", None)  # else what is beside Python's own modules is found while it starts
    begin = f"import sys; sys.path[:] = {search_path()!r}; "
    if own is not None:  # for the processes that it starts
        begin += f"import os; os.environ['PYTHONPATH'] = {own!r}; "
    return [sys.executable, "-P", "-c", begin + code], environment

"""What other packages announce by entry points. What of it cannot be used is left out, with a warning; the rest works."""

from __future__ import annotations

import importlib
import os
import sys
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn


class OutsidePackageWarning(UserWarning):
    """An entry point of another package cannot be used, and is left out."""


@contextmanager
def process_kept() -> Iterator[None]:
    """What a module may change while it is loaded is put back, and it cannot end the process without a word."""
    folder, leave = os.getcwd(), os._exit

    def refused(status: int = 0) -> NoReturn:
        raise SystemExit(status)

    os._exit = refused
    try:
        yield
    finally:
        os._exit = leave
        os.chdir(folder)


def announced(group: str) -> Iterator[tuple[EntryPoint, ModuleType, Any]]:
    """The entry points of a group with the modules and objects that they name, as far as these can be loaded."""
    for point in sorted(entry_points(group=group), key=lambda p: (p.name, p.value)):
        try:
            with process_kept():
                target = point.load()
            module = sys.modules[point.module]
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            leave_out(point, _failed(error))
        else:
            yield point, module, target


def leave_out(point: EntryPoint, reason: object) -> None:
    """Warn that an entry point, or one of the objects behind it, is not used."""
    package = f"{point.dist.name} {point.dist.version}" if point.dist else "an unknown package"
    text = f"{package}: entry point {point.name} = {point.value} of {point.group} is left out: {reason}"
    warnings.warn(f"{text}; update, mend or uninstall the package", OutsidePackageWarning, stacklevel=2)


def _failed(error: BaseException) -> str:
    """Why a module does not load, with the line in it."""
    machinery = ("<frozen ", str(Path(importlib.__file__).parent), __file__)
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(machinery)]
    where = f" ({frames[-1].filename}:{frames[-1].lineno})" if frames else ""
    if isinstance(error, SystemExit):
        return f"it ends the process while it is loaded, with exit status {error.code}{where}"
    return f"{type(error).__name__}: {error}{where}"

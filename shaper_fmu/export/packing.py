"""The steps that all backends share when they pack a component into an FMU."""

from __future__ import annotations

import ctypes
import hashlib
import threading
import traceback
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError, ShaperFmuError, nearest
from shaper_fmu.export.declarations import check_declaration

_LONGEST = 30.0
"""Seconds that the kernels may take for the start values and one step, as plain Python."""


def check_component(component: type[Component]) -> None:
    """Try the component as it is declared. Raises BuildError for what would surface only when the FMU runs."""
    name = component.__name__
    check_declaration(component)
    try:
        instance = component()
        with time_limit(_LONGEST):
            instance.initialize(0.0)
            instance.do_step(0.0, component.default_step_size)
    except KeyboardInterrupt:
        raise
    except TimeLimit as error:
        kernel, place = _running(component, error)
        raise BuildError(
            f"{name}.{kernel} has not ended after {_LONGEST:g} s with the start values; is there an endless loop at {place}?"
        ) from None
    except BaseException as error:  # SystemExit, too: a kernel that ends the process would end its host
        message = str(error) if isinstance(error, ShaperFmuError) else f"{type(error).__name__}: {error}"
        raise BuildError(f"{name} does not run with its start values: {message}") from error
    for attribute in vars(instance):
        if attribute not in component.variables:
            raise BuildError(f"{name} sets {attribute!r}, which is not declared.{nearest(attribute, component.variables)}")


class TimeLimit(BaseException):
    """A kernel has taken too long."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeLimit in the body if it still runs Python code after this time."""
    thread = ctypes.c_ulong(threading.get_ident())
    raise_in = ctypes.pythonapi.PyThreadState_SetAsyncExc
    timer = threading.Timer(seconds, lambda: raise_in(thread, ctypes.py_object(TimeLimit)))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        raise_in(thread, None)  # one that has not been raised yet


def _running(component: type[Component], error: BaseException) -> tuple[str, str]:
    """The kernel that an error has stopped, and the innermost place in it or in a function that it calls."""
    kernels = {getattr(component, name).__code__: name for name in ("start", "step")}
    kernel, place = "start", ""
    for frame in traceback.walk_tb(error.__traceback__):
        kernel = kernels.get(frame[0].f_code, kernel)
        place = f"{frame[0].f_code.co_filename}:{frame[1]}"
    return kernel, place


def licences(*packages: str) -> dict[str, bytes]:
    """The licence texts of installed packages that the FMU carries parts of."""
    texts = {}
    for package in packages:
        try:
            files = distribution(package).files or []
        except PackageNotFoundError:
            continue
        for file in files:
            if file.name.upper().startswith("LICENSE"):
                texts[f"documentation/licenses/{package}.txt"] = Path(str(file.locate())).read_bytes()
    return texts


def content_guid(files: dict[str, bytes]) -> str:
    """A GUID that stands for these files."""
    digest = hashlib.sha256()
    for path, content in sorted(files.items()):
        digest.update(f"{path}\0{len(content)}\0".encode() + content)
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16])) + "}"

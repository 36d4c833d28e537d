"""Isolated runs: the FMUs run in a separate process, so that a crash or a hang does not affect the caller.

The child is a fresh Python process, never a fork, which would inherit the FMUs' libraries and threads. It gets the system
pickled, with the caller's unpacked FMU folders. What comes back is data alone, never pickled. The state of the stepping
loop is in memory that both share, so the caller knows the simulated time even after a crash.
"""

from __future__ import annotations

import ctypes
import io
import math
import mmap
import os
import pickle
import sys
import threading
import types
from collections.abc import Callable
from functools import partial
from inspect import signature
from typing import Any

import msgspec
import numpy as np

from shaper_fmu import errors
from shaper_fmu.errors import ModelError, ShaperFmuError, SimulationError
from shaper_fmu.master import layout as of
from shaper_fmu.master.instance import moment
from shaper_fmu.master.isolated_process import BEGUN, CLOSED, Child, read_frame, send
from shaper_fmu.master.process_ends import leave_ends_to_the_caller
from shaper_fmu.master.results import Results
from shaper_fmu.master.signals import TypedSignal, typed_signal
from shaper_fmu.master.simulation import Progress, Simulation
from shaper_fmu.master.structure import SystemStructure


class _Packed(msgspec.Struct):
    """Results as data; columns are the bytes of float64."""

    time: bytes
    values: dict[str, bytes]
    units: dict[str, str]
    display_units: dict[str, tuple[str, float]]
    notes: tuple[str, ...]
    metrics: dict[str, float]


class _Answer(msgspec.Struct):
    """How the run ended: `error` is the name of the error's class, "" for none; `text` are its problems, or its one text."""

    error: str = ""
    text: list[str] = []
    results: _Packed | None = None


def simulate_isolated(
    system: SystemStructure,
    stop_time: float,
    step: float,
    *,
    time_limit: float | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Results:
    """Run the system in a child process; the options are those of `System.simulate`.

    Raises what the run raises there. A crash of the child, or its end after `time_limit` [s] of wall time, is a
    SimulationError with the simulated time; ModelError if the limit is wrong or an input's function cannot be sent.
    """
    if time_limit is not None and not (math.isfinite(time_limit) and time_limit > 0.0):
        raise ModelError([f"time_limit = {time_limit} s must be a finite number above 0"])
    names = dict(options)
    names.pop("record", None)
    signature(Simulation.run).bind(None, stop_time, step, **names)  # a wrong option is a TypeError here as in any run
    fmus = ", ".join(f"{name} ({fmu.name})" for name, fmu in system.fmus.items())
    answer, done, frame = None, False, b""
    with Child(_task(system, stop_time, step, options)) as child:
        try:
            for frame in child.frames(time_limit, progress):
                answer = _decoded(frame) if frame not in (BEGUN, CLOSED) else answer
            done, end = frame == CLOSED, child.end()
        except TimeoutError:
            end = f"its process was killed after the time_limit of {time_limit:g} s"
        if answer is not None and answer.error:
            raise _error(answer)
        results = _unpacked(answer.results) if answer is not None and answer.results is not None else None
        if not done or results is None:
            at = moment(child.time) if results is None else " when the FMUs were freed"
            lost = SimulationError(f"the isolated run ended{at}: {end}; FMUs: {fmus}{child.last_words()}")
            lost.results = results
            raise lost
    if progress is not None:
        progress(float(stop_time))
    return results


def _task(system: SystemStructure, stop_time: float, step: float, options: dict[str, Any]) -> bytes:
    """The data that the child needs. Raises ModelError for objects that cannot be sent."""
    signals = []
    for port, signal in system.signals.items():
        name = ".".join(port)
        bare = signal.signal if isinstance(signal, TypedSignal) else signal
        signals.append((port, _sendable(bare, f"input {name}: its function", "or give a table")))
    state = {**vars(system), "signals": {}}
    arguments = _sendable((stop_time, step, options), "simulate: an option", "or leave it out")
    return pickle.dumps((state, signals, arguments), pickle.HIGHEST_PROTOCOL)


class _Pickler(pickle.Pickler):
    """Refuses objects that the running script defines, since the child does not load that script."""

    def persistent_id(self, obj: Any) -> None:
        if isinstance(obj, type | types.FunctionType) and obj.__module__ == "__main__":
            raise pickle.PicklingError(f"{obj.__qualname__} is defined in the script that runs")


def _sendable(value: Any, what: str, otherwise: str) -> bytes:
    stream = io.BytesIO()
    try:
        _Pickler(stream, pickle.HIGHEST_PROTOCOL).dump(value)
    except Exception as error:  # objects may raise anything when they are pickled
        raise ModelError(
            [
                f"{what} cannot be sent to the process of an isolated run: {error}. Define functions by def at the top of a "
                f"module that is imported, {otherwise}"
            ]
        ) from None
    return stream.getvalue()


def _decoded(frame: bytes) -> _Answer:
    try:
        return msgspec.msgpack.decode(frame, type=_Answer)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise SimulationError(f"the isolated run gave an answer that cannot be read: {error}") from None


def _error(answer: _Answer) -> ShaperFmuError:
    """The error that was raised in the child; one that is not ours as a SimulationError."""
    kind = getattr(errors, answer.error, None)
    if kind is ModelError:
        return ModelError(answer.text)
    text = "\n".join(answer.text)
    if not (isinstance(kind, type) and issubclass(kind, ShaperFmuError)):
        return SimulationError(f"the isolated run failed: {answer.error}: {text}")
    error = kind(text)
    if isinstance(error, SimulationError) and answer.results is not None:
        error.results = _unpacked(answer.results)
    return error


def _packed(results: Results) -> _Packed:
    values = {name: column.tobytes() for name, column in results.values.items()}
    return _Packed(
        results.time.tobytes(), values, dict(results.units), dict(results.display_units), results.notes, dict(results.metrics)
    )


def _unpacked(packed: _Packed) -> Results:
    values = {name: np.frombuffer(column).copy() for name, column in packed.values.items()}
    return Results(np.frombuffer(packed.time).copy(), values, packed.units, packed.display_units, packed.notes, packed.metrics)


# The child's side


class _Watched(Simulation):
    """A simulation for one run, whose loop keeps its state in shared memory."""

    window: mmap.mmap
    _shared: Any = None

    def _controller(self, program: Any, control: of.Control, *others: Any) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        return super()._controller(program, self._moved(control), *others)

    def _stepped(self, program: Any, control: of.Control, *others: Any) -> Results:  # pyright: ignore[reportIncompatibleMethodOverride]
        return super()._stepped(program, self._moved(control), *others)

    def _moved(self, control: of.Control) -> Any:
        if self._shared is None:
            self._shared = of.Control.from_buffer(self.window)
            ctypes.pointer(self._shared)[0] = control
        return self._shared


class _Nothing(SystemStructure):
    """A system without FMUs that may run."""

    def check(self) -> list[str]:
        return []


def serve(channel: int, window: str) -> None:
    """The child's work: take the plan from standard input, run it, and send the answer to the file descriptor `channel`."""
    leave_ends_to_the_caller()
    orders = os.dup(0)
    empty = os.open(os.devnull, os.O_RDONLY)
    os.dup2(empty, 0)
    with os.fdopen(os.dup(orders), "rb") as stream:
        plan = read_frame(stream)
    threading.Thread(target=_end_with_the_caller, args=(orders,), daemon=True).start()
    try:
        system, (stop_time, step, options) = _restored(plan or b"")
        with Simulation(_Nothing()) as simulation:
            simulation.run(1.0, 1.0)  # loads the loop, or compiles it: the time limit is for the FMUs
        send(channel, BEGUN)
        simulation = _Watched(system, options.pop("record", None))
    except Exception as error:
        send(channel, _failure(error))
    else:
        size = of.CONTROL.itemsize
        simulation.window = mmap.mmap(-1, size, tagname=window) if sys.platform == "win32" else mmap.mmap(int(window), size)
        with simulation:  # the answer is sent before the instances are freed, which may crash, too
            send(channel, _outcome(partial(simulation.run, stop_time, step, **options)))
    send(channel, CLOSED)
    sys.stderr.flush()


def _end_with_the_caller(orders: int) -> None:
    """End the process when standard input is closed, which means that the caller has ended."""
    os.read(orders, 1)
    os._exit(1)


def _restored(plan: bytes) -> tuple[SystemStructure, tuple[float, float, dict[str, Any]]]:
    """The system and the arguments of the run. Raises ModelError for a function that this process cannot load."""
    state, signals, arguments = pickle.loads(plan)
    system = SystemStructure()
    vars(system).update(state)
    for port, data in signals:
        name = ".".join(port)
        try:
            signal = pickle.loads(data)
        except Exception as error:  # importing a module may raise anything
            raise ModelError(
                [f"input {name}: its function cannot be loaded in the process of an isolated run: {type(error).__name__}: {error}"]
            ) from None
        variable = system.fmus[port[0]].variables[port[1]]
        system.signals[port] = typed_signal(variable, signal, name)
    return system, pickle.loads(arguments)


def _outcome(run: Callable[[], Results]) -> bytes:
    try:
        return msgspec.msgpack.encode(_Answer(results=_packed(run())))
    except Exception as error:
        return _failure(error)


def _failure(error: Exception) -> bytes:
    results = getattr(error, "results", None)
    text = error.problems if isinstance(error, ModelError) else [str(error)]
    return msgspec.msgpack.encode(_Answer(type(error).__name__, text, _packed(results) if results is not None else None))

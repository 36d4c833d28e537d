"""The compiled loop against the same FMI calls from C, with nothing between them."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path
from statistics import median

import numpy as np
from chain import FILES, RESULT, STEP, STEPS, Ours, chain_archive
from harness import Measured, Row, compared
from host import compiled

from shaper_fmu.master.instance import Instance
from shaper_fmu.ssp.archive import load_ssp

PASSES = 15
"""Of both sides, in turn: a few milliseconds each, of this thread on a processor (what others take is not counted)."""

WIRES = {"profile": ("", "position"), "shaper": ("command", "shaped"), "plant": ("force", "position")}
"""Input and output of each instance."""

SOURCES = {"shaper": "profile.position", "plant": "shaper.shaped"}


class _Calls(ctypes.Structure):
    """As in bare_calls.c."""

    _fields_ = [
        *[(name, ctypes.c_void_p) for name in ("instance", "set", "get", "step")],
        ("input", ctypes.c_uint),
        ("output", ctypes.c_uint),
        ("values", ctypes.c_void_p),
        ("results", ctypes.c_void_p),
    ]


class _Bare:
    """The three instances, and the calls to them from C."""

    def __init__(self, archive: Path):
        system = load_ssp(archive).system
        self._system = system
        self._instances = {name: Instance(name, system.fmus[name]) for name in FILES}
        recorded = system.simulate(STEPS * STEP, STEP, algorithm="parallel", exact=False, record=[*SOURCES.values()])
        self._inputs = {name: np.ascontiguousarray(recorded[source][:-1]) for name, source in SOURCES.items()}
        self._outputs = {name: np.empty(STEPS) for name in FILES}
        self._calls = (_Calls * len(FILES))(*[self._row(name) for name in FILES])
        self._function = ctypes.CDLL(str(compiled("bare_calls.c", ["-shared", "-fPIC"]))).bare_calls
        self._function.restype = ctypes.c_double
        self._function.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_double]

    def _row(self, name: str) -> _Calls:
        instance, (inlet, outlet) = self._instances[name], WIRES[name]
        handle, step = instance.handle, instance.address("fmi2DoStep")
        variables = instance.fmu.variables
        return _Calls(
            handle,
            instance.address("fmi2SetReal") if inlet else None,
            instance.address("fmi2GetReal"),
            step,
            variables[inlet].valueReference if inlet else 0,
            variables[outlet].valueReference,
            self._inputs[name].ctypes.data if inlet else None,
            self._outputs[name].ctypes.data,
        )

    def stepping(self) -> Measured:
        """A pass over instances that are reset and initialized before."""
        for name, instance in self._instances.items():
            instance.reset()
            instance.enter_initialization(0.0, STEPS * STEP, self._system.start_values[name])
            instance.call("exitInitializationMode")
        seconds = self._function(self._calls, len(FILES), STEPS, STEP)
        if seconds < 0.0:
            raise SystemExit("loop_vs_bare_calls: a call failed")
        return Measured(seconds * 1e6, tuple(self._outputs[RESULT.split(".")[0]].tolist()))

    def close(self) -> None:
        for instance in self._instances.values():
            instance.close()


def _medians(runs: Sequence[tuple[Measured, Measured]]) -> list[Measured]:
    sides = zip(*runs, strict=True)
    return [Measured(median(one.microseconds for one in side), side[-1].results) for side in sides]


def loop_vs_bare_calls(folder: Path) -> Row:
    """A macro step of the compiled loop, with wiring and record, against its FMI calls alone; bit for bit the same results."""
    archive = chain_archive(folder)
    bare = _Bare(archive)
    with Ours(archive) as ours:
        row = compared(
            "loop_vs_bare_calls",
            lambda: _medians([(ours.stepping(), bare.stepping()) for _ in range(PASSES)]),
            tolerance=0.0,
            needed=1 / 1.5,
        )
    bare.close()
    return row

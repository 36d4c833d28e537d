"""SUNDIALS' CVODE, from the libraries that fmpy's package carries, set up for the loop (see loop/solver.c).

What it calls - derivatives, event indicators, the Jacobian - are functions of the loop's: no Python runs while it integrates.
"""

from __future__ import annotations

import ctypes
import functools
import weakref
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np

from shaper_fmu.errors import SimulationError
from shaper_fmu.master import layout as of
from shaper_fmu.master.loop_library import loop

_METHODS = {"adams": 1, "bdf": 2}  # CV_ADAMS, CV_BDF
_MOST_STATES = 5_000
"""The Jacobian is dense."""


class _Library(NamedTuple):
    core: ctypes.CDLL
    vectors: ctypes.CDLL
    matrices: ctypes.CDLL
    linear: ctypes.CDLL
    cvode: ctypes.CDLL


@functools.lru_cache(maxsize=1)
def _library() -> _Library:
    """Raises SimulationError where fmpy's package has no libraries for this machine."""
    try:
        from fmpy.sundials import libraries as found
    except OSError as error:
        raise SimulationError(f"model exchange needs SUNDIALS, of which fmpy has no library for this machine: {error}") from None
    return _Library(
        found.sundials_core, found.sundials_nvecserial, found.sundials_sunmatrixdense, found.sundials_sunlinsoldense,
        found.sundials_cvode,
    )  # fmt: skip


def _function(library: ctypes.CDLL, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
    found = library[name]
    found.restype, found.argtypes = result, arguments
    return found


def _address(library: ctypes.CDLL, name: str) -> int:
    return ctypes.cast(library[name], ctypes.c_void_p).value or 0


class Cvode:
    """CVODE's memory for `states` continuous states and `indicators` of events; one state stands for none.

    Attributes:
        row: see layout.SOLVER, with all that does not change.
        values: states, and event indicators, which the row points to.
    """

    def __init__(self, method: Literal["bdf", "adams"], states: int, indicators: int, with_jacobian: bool):
        if states > _MOST_STATES:
            raise SimulationError(f"{states} continuous states are solved together, more than {_MOST_STATES}")
        library, count = _library(), max(1, states)
        address, number, truth = ctypes.c_void_p, ctypes.c_int64, ctypes.c_int
        self._context = address()
        _function(library.core, "SUNContext_Create", truth, truth, address)(0, ctypes.byref(self._context))
        _function(library.core, "SUNContext_ClearErrHandlers", truth, address)(self._context)  # what fails is told by the loop
        new_vector = _function(library.vectors, "N_VNew_Serial", address, number, address)
        data = _function(library.vectors, "N_VGetArrayPointer_Serial", address, address)
        self._vectors: list[int] = [new_vector(count, self._context) for _ in range(3)]
        new_matrix = _function(library.matrices, "SUNDenseMatrix", address, number, number, address)
        self._matrix: int = new_matrix(count, count, self._context)
        if not (all(self._vectors) and self._matrix):
            raise SimulationError(f"there is not enough memory to solve {states} continuous states together")
        values = [data(vector) for vector in self._vectors]
        for place in values:
            ctypes.memset(place, 0, 8 * count)
        self._columns = np.zeros(count, np.uintp)
        solver = _function(library.linear, "SUNLinSol_Dense", address, address, address, address)
        self._linear = solver(self._vectors[0], self._matrix, self._context)
        self._memory = address(_function(library.cvode, "CVodeCreate", address, truth, address)(_METHODS[method], self._context))
        self.row: np.ndarray = np.zeros(1, of.SOLVER)
        row: Any = self.row[0]
        row["memory"], row["states"], row["indicators"] = self._memory.value, states, indicators
        row["columns"] = self._columns.ctypes.data
        self.values: np.ndarray = np.zeros(count + 2 * indicators)
        self._signs = np.zeros(max(1, indicators), np.int32)
        row["begin_values"], row["signs"] = self.values.ctypes.data, self._signs.ctypes.data
        row["indicator_values"] = row["begin_values"] + 8 * count
        row["left_indicators"] = row["indicator_values"] + 8 * indicators
        for name, vector, place in zip(("state", "absolute", "between"), self._vectors, values, strict=True):
            row[name], row[f"{name}_values"] = vector, place
        for name, function in _CALLED.items():
            row[name] = _address(library.cvode, function)
        row["data"] = _address(library.vectors, "N_VGetArrayPointer_Serial")
        row["column"] = _address(library.matrices, "SUNDenseMatrix_Column")
        self._call("CVodeInit", _address(loop().library, "loop_derivatives"), ctypes.c_double(0.0), self._vectors[0])
        self._call("CVodeSetLinearSolver", self._linear, self._matrix)
        self._call("CVodeSetMaxHnilWarns", truth(-1))
        if indicators:
            self._call("CVodeRootInit", truth(indicators), _address(loop().library, "loop_indicators"))
            self._call("CVodeSetNoInactiveRootWarn")
        if with_jacobian and states:
            self._call("CVodeSetJacFn", _address(loop().library, "loop_jacobian"))
        if method == "bdf":  # of high order it is not stable for lightly damped oscillations, unless that is looked for
            self._call("CVodeSetStabLimDet", truth(1))
        weakref.finalize(self, _free, library, self._memory, self._linear, self._matrix, self._vectors, self._context)

    def attach(self, solver: int) -> None:
        """Have CVODE's callbacks get the address of the solver's record."""
        self._call("CVodeSetUserData", solver)

    def _call(self, name: str, *arguments: Any) -> None:
        types = [type(one) if isinstance(one, ctypes._SimpleCData) else ctypes.c_void_p for one in arguments]
        flag = _function(_library().cvode, name, ctypes.c_int, ctypes.c_void_p, *types)(self._memory, *arguments)
        if flag < 0:
            raise SimulationError(f"{name} of SUNDIALS failed ({flag})")


_CALLED = {
    "step": "CVode", "begin": "CVodeReInit", "interpolate": "CVodeGetDky", "set_stop": "CVodeSetStopTime",
    "set_longest": "CVodeSetMaxStep", "set_first": "CVodeSetInitStep", "set_tolerances": "CVodeSVtolerances",
}  # fmt: skip
"""What the loop calls, by the record's fields."""


def _free(library: _Library, memory: Any, linear: int, matrix: int, vectors: list[int], context: Any) -> None:
    address = ctypes.c_void_p
    _function(library.cvode, "CVodeFree", None, address)(ctypes.byref(memory))
    _function(library.linear, "SUNLinSolFree_Dense", ctypes.c_int, address)(linear)
    _function(library.matrices, "SUNMatDestroy_Dense", None, address)(matrix)
    for vector in vectors:
        _function(library.vectors, "N_VDestroy_Serial", None, address)(vector)
    _function(library.core, "SUNContext_Free", ctypes.c_int, address)(ctypes.byref(context))

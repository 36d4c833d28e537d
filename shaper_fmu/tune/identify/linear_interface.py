"""The parts of an FMU's interface that a linearization needs: states, directional derivatives, an instance at a point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from ctypes import c_double
from dataclasses import dataclass
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException

from shaper_fmu.errors import ShaperFmuError, SimulationError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.model_exchange import directional_flags
from shaper_fmu.master.variables import kind_of

_MOST_UPDATES = 100
_MOST_STATES = 1000
_LARGEST = 1e100
"""Of values that are worked with; products of them shall be finite, too."""
_NOMINAL = (1e-50, 1e50)


class LinearizationError(ShaperFmuError):
    """An FMU cannot be linearized; the message gives the reason."""


class NoLinearizationError(LinearizationError):
    """An FMU does not declare the functions that a linearization needs; the message names them."""


@dataclass(frozen=True)
class Interface:
    """The parts of an FMU's interface that a linearization needs.

    Attributes:
        states, derivatives: names of the continuous states and of their derivatives, element by element.
        exchange: whether it has Model Exchange.
        directional: whether co-simulation and Model Exchange provide directional derivatives.
    """

    states: tuple[str, ...]
    derivatives: tuple[str, ...]
    exchange: bool
    directional: tuple[bool, bool]


def interface_of(fmu: Fmu) -> Interface:
    """The declared interface. Raises LinearizationError if it contradicts itself, NoLinearizationError if parts are missing."""
    flags = directional_flags(fmu)
    exchange = fmu.description.modelExchange is not None
    if not (exchange or flags[0]):
        raise NoLinearizationError(
            f"{fmu.name} cannot be linearized: it has neither Model Exchange nor directional derivatives in co-simulation"
        )
    states: list[str] = []
    derivatives: list[str] = []
    for unknown in fmu.description.derivatives:
        rate = unknown.variable
        state = rate.derivative if rate is not None else None
        if rate is None or state is None:
            raise LinearizationError(
                f"{fmu.name} cannot be linearized: its ModelStructure lists a derivative, but not of which state"
            )
        pair = fmu.elements_of(str(state.name)), fmu.elements_of(str(rate.name))
        known = all(name in fmu.variables for names in pair for name in names)  # not where a name stands for several variables
        if not known or len(pair[0]) != len(pair[1]) or any(kind_of(one) != "real" for one in (rate, state)):
            message = f"{state.name} and its derivative {rate.name} are not real, or not of the same size"
            raise LinearizationError(f"{fmu.name} cannot be linearized: {message}")
        states += pair[0]
        derivatives += pair[1]
    if not states:
        raise NoLinearizationError(f"{fmu.name} cannot be linearized: it declares no continuous states in its ModelStructure")
    if len(states) > _MOST_STATES:
        raise NoLinearizationError(f"{fmu.name} has {len(states)} states; up to {_MOST_STATES} are linearized")
    return Interface(tuple(states), tuple(derivatives), exchange, flags)


def directional(instance: Instance, unknowns: Sequence[str], known: str) -> np.ndarray:
    """d unknowns / d known by the FMU's directional derivatives, shape (len(unknowns),). Raises SimulationError."""
    wholes = instance.fmu.whole_variables(unknowns)
    ((reference, elements),) = instance.fmu.whole_variables([known])
    seed = [float(name == known) for name in elements]
    names = [name for _, whole in wholes for name in whole]
    sizes = (len(names),) if instance.fmu.version == 3 else ()
    references = [one for one, _ in wholes]
    values = _called(instance, "getDirectionalDerivative", references, [reference], seed, *sizes)
    found = dict(zip(names, values, strict=True))
    return finite(instance, [found[name] for name in unknowns], f"directional derivatives with respect to {known}")


def finite(instance: Instance, values: Sequence[float], what: str) -> np.ndarray:
    """The values as an array. Raises SimulationError for values that are not finite, or beyond 1e100."""
    array = np.array(values, float)
    wrong = ~(np.abs(array) <= _LARGEST)
    if wrong.any():
        raise SimulationError(
            f"{instance.name}: {instance.fmu.name} gives {what} of {array[wrong][0]}, with which nothing can be reckoned"
        )
    return array


def magnitude(declared: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Magnitudes of states: nominal values (1 where they are 0), or what they are, if that is more; both of shape (n,)."""
    nominal = np.abs(declared)
    return np.clip(np.maximum(np.where(nominal > 0.0, nominal, 1.0), np.abs(state)), *_NOMINAL)


def values(instance: Instance, names: Sequence[str]) -> np.ndarray:
    """Values of variables, which must be finite, shape (len(names),)."""
    return finite(instance, instance.get_values(names), f"values of {', '.join(names)}")


def _called(instance: Instance, method: str, *arguments: Any) -> Any:
    """The result of a method of fmpy's instance, with its status checked."""
    try:
        return getattr(instance.slave, method)(*arguments)
    except FMICallException as error:
        raise instance.failure(error.function, error.status) from None


class Exchange:
    """An instance for Model Exchange in continuous-time mode, for its right-hand side der(x) = f(t, x, u) and outputs.

    Use it in a with statement. Raises SimulationError where a call fails or the FMU does not do as it declares.
    """

    def __init__(self, name: str, fmu: Fmu, states: Sequence[str], start_values: Mapping[str, Any], time: float):
        self.instance: Instance = Instance(name, fmu.with_interface("model_exchange"))
        self._count = len(states)
        try:
            self._begin(start_values, time)
        except BaseException:
            self.instance.close()
            raise

    def __enter__(self) -> Exchange:
        return self

    def __exit__(self, *error: object) -> None:
        self.instance.close()

    def _begin(self, start_values: Mapping[str, Any], time: float) -> None:
        instance = self.instance
        instance.enter_initialization(0.0, None, start_values)
        instance.call("exitInitializationMode", at="initialization")
        update = "newDiscreteStates" if instance.fmu.version == 2 else "updateDiscreteStates"
        for _ in range(_MOST_UPDATES):
            again, ends, *_ = _called(instance, update)
            if ends:
                raise SimulationError(f"{instance.name} at initialization: {update} asked to end the simulation")
            if not again:
                break
        else:
            raise SimulationError(f"{instance.name} at initialization: {update} asked for another update again and again")
        instance.call("enterContinuousTimeMode", at="initialization")
        if instance.fmu.version == 3:
            count = _called(instance, "getNumberOfContinuousStates")
            if count != self._count:
                raise SimulationError(f"{instance.name}: {instance.fmu.name} declares {self._count} states but has {count}")
        instance.call("setTime", time)

    def _vector(self, method: str, what: str) -> np.ndarray:
        array = (c_double * self._count)(*[np.nan] * self._count)
        self.instance.call(method, array, self._count)
        return finite(self.instance, list(array), what)

    @property
    def state(self) -> np.ndarray:
        """The continuous states x, shape (n,)."""
        return self._vector("getContinuousStates", "states")

    @state.setter
    def state(self, x: np.ndarray) -> None:
        self.instance.call("setContinuousStates", (c_double * self._count)(*x), self._count)

    @property
    def nominal(self) -> np.ndarray:
        """The states' nominal values, shape (n,)."""
        return self._vector("getNominalsOfContinuousStates", "nominal values")

    @property
    def derivative(self) -> np.ndarray:
        """der(x), shape (n,)."""
        name = "getDerivatives" if self.instance.fmu.version == 2 else "getContinuousStateDerivatives"
        return self._vector(name, "state derivatives")

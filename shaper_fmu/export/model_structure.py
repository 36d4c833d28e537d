"""The model structure of a model description: states, derivatives and dependencies."""

from __future__ import annotations

import dis
import math
from typing import Any

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import BuildError, nearest


def visible_variables(component: type[Component]) -> list[Variable[Any]]:
    """The variables that the FMU shows, in the order of their declaration."""
    return [v for v in component.variables.values() if v.causality != "state"]


def names_of(component: type[Component], *causalities: str) -> tuple[str, ...]:
    """Names of the variables of these causalities, in the order of their declaration."""
    return tuple(v.name for v in component.variables.values() if v.causality in causalities)


def dependencies(component: type[Component], output: Variable[Any]) -> tuple[str, ...]:
    """Names of the inputs that act on the output without delay. Raises BuildError if one of them is not an input."""
    inputs = names_of(component, "input")
    if output.depends is None:
        return inputs
    for name in output.depends:
        if name not in inputs:
            raise BuildError(
                f"{component.__name__}: depends of {output.name!r} names {name!r}, which is not an input.{nearest(name, inputs)}"
            )
    return output.depends


def derivative_of(component: type[Component], variable: Variable[Any]) -> Variable[Any] | None:
    """The variable that is this one's time derivative, or None. Raises BuildError if it could not be that."""
    if not variable.derivative:
        return None
    where = f"{component.__name__}: the derivative of {variable.name!r}"
    known = names_of(component, "output", "local")
    if variable.derivative not in known:
        raise BuildError(f"{where}, {variable.derivative!r}, must be an output or a local.{nearest(variable.derivative, known)}")
    found = component.variables[variable.derivative]
    if variable.kind is not float or found.kind is not float or variable.size != found.size:
        raise BuildError(f"{where}, {found.name!r}, must be of type float and the same size as {variable.name!r}")
    return found


def continuous_states(component: type[Component]) -> list[tuple[Variable[Any], Variable[Any]]]:
    """Pairs (state, its derivative) in the order of `component.continuous_states`.

    Raises BuildError for a name that cannot be a state, a missing derivative, or one that serves two states.
    """
    known = names_of(component, "output", "local")
    pairs: list[tuple[Variable[Any], Variable[Any]]] = []
    for name in component.continuous_states or ():
        if name not in known:
            raise BuildError(
                f"{component.__name__}: continuous_states names {name!r}, which is not an output or local.{nearest(name, known)}"
            )
        state = component.variables[name]
        derivative = derivative_of(component, state)
        if derivative is None:
            raise BuildError(f"{component.__name__}: the continuous state {name!r} needs a derivative; declare derivative=...")
        for other_state, other in pairs:
            if other is derivative or other_state is state:
                raise BuildError(
                    f"{component.__name__}: the continuous states {other_state.name!r} and {name!r} cannot share the derivative "
                    f"{derivative.name!r}; declare a variable for each"
                )
        pairs.append((state, derivative))
    return pairs


def output_derivative_order(component: type[Component]) -> int:
    """How often outputs can be differentiated: the longest chain of derivatives that begins at an output.

    Raises BuildError for a chain without an end.
    """
    longest = 0
    for name in names_of(component, "output"):
        chain = [name]
        while (following := derivative_of(component, component.variables[chain[-1]])) is not None:
            if following.name in chain:
                raise BuildError(
                    f"{component.__name__}: the derivatives {' -> '.join([*chain, following.name])} go round in a circle"
                )
            chain.append(following.name)
        longest = max(longest, len(chain) - 1)
    return longest


def knowns(component: type[Component], unknown: Variable[Any], states: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the inputs and continuous states that an output or derivative depends on at one instant; a state is known."""
    return (unknown.name,) if unknown.name in states else (*dependencies(component, unknown), *states)


def initial_knowns(component: type[Component], unknown: Variable[Any]) -> tuple[str, ...]:
    """Names of the inputs and parameters that an output, state, derivative or calculated parameter depends on at the start."""
    inputs = () if unknown.causality == "calculatedParameter" else dependencies(component, unknown)
    return (*inputs, *names_of(component, "parameter"))


def initial_unknowns(component: type[Component], states: list[tuple[Variable[Any], Variable[Any]]]) -> list[Variable[Any]]:
    """The initial unknowns: outputs, calculated parameters, states and their derivatives, in declared order."""
    exposed = {v.name for pair in states for v in pair}
    return [
        v
        for v in component.variables.values()
        if v.causality in ("output", "calculatedParameter") or (v.causality == "local" and v.name in exposed)
    ]


def nominals(component: type[Component]) -> dict[str, list[float]]:
    """Nominal values of the variables that declare one, each element's, with the start values of all parameters.

    Raises BuildError for one that is neither a positive number nor the name of a variable of the same size.
    """
    declared = [v for v in component.variables.values() if v.nominal is not None]
    if not declared:
        return {}
    started = component()
    started.initialize()
    found: dict[str, list[float]] = {}
    for variable in declared:
        where = f"{component.__name__}: the nominal of {variable.name!r}"
        nominal: Any = variable.nominal
        if isinstance(nominal, str):
            other = component.variables.get(nominal)
            if other is None or other.kind is not float or other.size != variable.size:
                near = nearest(nominal, component.variables)
                raise BuildError(f"{where}, {nominal!r}, must be a variable of type float and the same size.{near}")
            nominal = getattr(started, nominal)
        found[variable.name] = [float(x) for x in (nominal if isinstance(nominal, list) else [nominal] * (variable.size or 1))]
        if variable.kind is not float or not all(0.0 < x < math.inf for x in found[variable.name]):
            raise BuildError(f"{where} is {nominal}; it must be a positive number, and the variable of type float")
    return found


def reads_time(component: type[Component]) -> bool:
    """Whether the step kernel reads its time argument: if it does not, nothing depends on the time itself."""
    code = getattr(component.step, "__code__", None)
    if code is None or code.co_argcount < 2:
        return True
    name = code.co_varnames[1]
    used = [i.argval for i in dis.get_instructions(code)]
    return any(value == name or (isinstance(value, tuple) and name in value) for value in used)

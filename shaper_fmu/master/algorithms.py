"""The algorithms that take a system from one communication point t to the next, t + h.

An input that is set at t holds over [t, t + h].

- "jacobi": every input is its source's output at t. Inputs that act on an output without delay (direct feedthrough, as
  the FMUs declare it) are set before that output is read, so that all values of a communication point belong together.
  Nothing is delayed by FMUs that may be read then (see operations.py): this is the algorithm for commands on their way
  through shapers to plants.
- "parallel": the same without that order: an input is what its source's output was at the end of the step before,
  whatever has been set since. Each instance with direct feedthrough delays by a step. Most other masters do this.
- "gauss_seidel": the instances step one after the other, in the order of their connections, and an input fed by an
  instance that has already stepped is that one's output at t + h.
"""

from __future__ import annotations

from typing import Literal, get_args

Algorithm = Literal["jacobi", "parallel", "gauss_seidel"]

SolverMethod = Literal["auto", "bdf", "adams"]
"""CVODE's formulas for FMUs of model exchange: BDF for stiff systems (order 1 to 5), Adams' for all others (order 1 to 12); "auto"
begins with Adams' and goes over to BDF where a communication step takes more than a thousand of its steps.
"""

Coupling = Literal["monolithic", "steps"]
"""How FMUs of model exchange act on each other: in every evaluation of the solver, or at communication points, like all others."""

ALGORITHMS: tuple[str, ...] = get_args(Algorithm)

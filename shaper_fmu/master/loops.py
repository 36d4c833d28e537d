"""Algebraic loops: each is cut at one input, and solved at the start.

The cut input gets its source's value before the others are exchanged. At initialization that value is iterated until the
loop closes (Powell's hybrid method); at later communication points the input is behind by one exchange.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from shaper_fmu.errors import SimulationError
from shaper_fmu.master.wiring import Loop

_CLOSED = 1e-9
"""Tolerated difference between a loop's value and what comes back, relative to 1 + |value|."""


def solve_loops(loops: Sequence[Loop], bus: np.ndarray, places: Sequence[int], exchange: Callable[[], None]) -> None:
    """Find values of the cut inputs' sources that come back from the exchange as they went in, and leave them on the bus.

    `places` are the sources' places; `exchange` spreads the bus over the connections, and reads what follows without delay.
    Raises SimulationError where no such values are found, and what `exchange` raises.
    """
    where = np.array(list(dict.fromkeys(places)), np.intp)

    def excess(values: np.ndarray) -> np.ndarray:
        bus[where] = values
        exchange()
        return bus[where] - values

    from scipy.optimize import root  # takes longer to load than all else that a run needs

    solution: Any = root(excess, bus[where].copy(), method="hybr", options={"xtol": 1e-14})
    left = excess(solution.x)
    if not np.all(np.abs(left) <= _CLOSED * (1.0 + np.abs(solution.x))):
        raise SimulationError(
            f"initialization: {'; '.join(map(loop_text, loops))}: no values were found that close the loop, the nearest miss it by "
            f"{np.max(np.abs(left)):.3g}; break it with an FMU that has no direct feedthrough"
        )


def loop_text(loop: Loop) -> str:
    """A loop as a text."""
    return f"loop without delay {' -> '.join('.'.join(port) for port in loop)}"

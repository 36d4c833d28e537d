"""The limited deflection of a mode in the linear programme of a move: its state at the cells' ends, and q in their middles.

Columns, each scaled with the limit: q at the ends, q' / w there, q in the middles. Between these instants q may exceed the limit a
little: the programme is then a relaxation, so that its bound holds; the polished move keeps the limit at all times. Without the
middles the control could alternate along a limit, with q reaching it at the ends alone.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from shaper_fmu.design.moves.deflection import Deflection

COLUMNS = 3
"""Columns of a cell."""


def deflection_rows(one: Deflection, widths: np.ndarray, block: int, columns: int) -> list[sparse.csr_matrix]:
    """The equations of the columns from `block` on; those of the acceleration in the cells are the first."""
    n = len(widths)
    return [
        _rows(one, widths, block, block, 0, columns),
        _rows(one, widths, block + n, block, 1, columns),
        _rows(one, 0.5 * widths, block + 2 * n, block, 0, columns),
    ]


def _rows(one: Deflection, h: np.ndarray, column: int, block: int, derivative: int, columns: int) -> sparse.csr_matrix:
    """q or q' / w after h from the cell's begin, from the state there and the acceleration."""
    w, i = one.frequency, np.arange(len(h))
    sigma = one.damping_ratio * w
    fast, slow = one.unit(-1, h), one.unit(0, h)
    of_state = (-w * slow, fast) if derivative else (fast + 2.0 * sigma * slow, w * slow)
    of_control = one.unit(1 - derivative, h) / (one.limit * (w if derivative else 1.0))
    parts = [(i, column + i, np.ones(len(h))), (i, i, of_control)]
    parts += [(i[1:], block + k * len(h) + i[:-1], -value[1:]) for k, value in enumerate(of_state)]
    rows, places, values = (np.concatenate(each) for each in zip(*parts, strict=True))
    return sparse.csr_matrix((values, (rows, places)), shape=(len(h), columns))

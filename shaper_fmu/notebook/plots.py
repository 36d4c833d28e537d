"""Plots for notebooks and scripts: the project's figures on matplotlib's axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from shaper_fmu.errors import ArgumentError, ShaperFmuError
from shaper_fmu.page.figures import Figure

_WIDTH, _HEIGHT, _ALONE = 8.0, 2.6, 4.2
"""Of a picture, of one figure among several and of one alone [inches]."""


def plot(figures: Sequence[Figure], axes: Any = None) -> Any:
    """Draw figures one below the other on new axes of pyplot, or on those that are given: one for each figure.

    Returns the axes: one for one figure, else an array of them. A notebook shows them, a script by matplotlib.pyplot.show().
    Raises ShaperFmuError without matplotlib, ArgumentError where there is nothing to see, or for another number of axes.
    """
    if not figures:
        raise ArgumentError("there is nothing to plot")
    try:
        import matplotlib.pyplot as pyplot
    except ImportError:
        raise ShaperFmuError("plot needs the package matplotlib: pip install 'shaper-fmu[plot]'") from None
    import numpy as np

    from shaper_fmu.page.pictures import draw

    if axes is None:
        height = _ALONE if len(figures) == 1 else _HEIGHT * len(figures)
        _, axes = pyplot.subplots(len(figures), 1, figsize=(_WIDTH, height), layout="constrained", squeeze=False)
    given = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(given) != len(figures):
        raise ArgumentError(f"axes: {len(given)} are given, and {len(figures)} are needed: {', '.join(f.title for f in figures)}")
    for figure, place in zip(figures, given, strict=True):
        draw(figure, place)
    return given[0] if len(given) == 1 else given

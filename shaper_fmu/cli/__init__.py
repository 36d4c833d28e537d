"""The command line, with one file per command; it prints warnings about other packages in a line."""

from __future__ import annotations

import sys
import warnings

from shaper_fmu.methods.announced import OutsidePackageWarning

_usual = warnings.showwarning


def _shown(message: Warning | str, category: type[Warning], *place: object) -> None:
    if issubclass(category, OutsidePackageWarning):
        print(f"warning: {message}", file=sys.stderr)
    else:
        _usual(message, category, *place)  # pyright: ignore[reportArgumentType]


warnings.showwarning = _shown  # before the commands are imported, which look for what is announced

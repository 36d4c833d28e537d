"""What is not installed, told in a line before the work that is done without it.

Where a command cannot do without it, it is refused: a file's ending by `arguments.output_file`, a compiler by the export.
"""

from __future__ import annotations

from shaper_fmu.console import err
from shaper_fmu.export.build import fmu_path
from shaper_fmu.export.native.toolchain import has_toolchain
from shaper_fmu.page.blocks import can_draw


def tell_missing(*, pages: bool = False, panel: bool = False, fmus: bool = False, shaper: bool = False) -> None:
    """Print what will not be there.

    Args:
        pages: pages are written, with pictures beside them.
        panel: and with a live panel, which is compiled unless it was shipped.
        fmus: FMUs are built, with pictures in their documentation.
        shaper: the FMU of a shaper is written, which is compiled with its start values. Raises BuildError if there is no plain one
            either.
    """
    without = [
        text
        for text, wanted in (("the page without pictures beside it", pages), ("the FMUs' pages without pictures", fmus))
        if wanted
    ]
    if without and not can_draw():
        err.print(f"note: matplotlib is not installed, so {' and '.join(without)}: pip install 'shaper-fmu[report]'")
    if has_toolchain():
        return
    from shaper_fmu.live.shipped import has_panel

    parts = [
        text
        for text, wanted in (
            ("the shaper's FMU is the plain one", shaper),
            ("the page has no live panel", panel and not has_panel()),
        )
        if wanted
    ]
    if parts:
        if shaper:
            fmu_path("InputShaper")
        err.print(f"note: there is no compiler, so {' and '.join(parts)}: pip install 'shaper-fmu[native]'")

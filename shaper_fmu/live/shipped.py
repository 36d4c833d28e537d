"""The kernels of pages that a wheel carries as WebAssembly, so that pages are written without a compiler.

`python -m shaper_fmu.live.shipped` writes them, after `shaper_fmu.export.build` has emptied the folder of what is shipped.
"""

from __future__ import annotations

from shaper_fmu.component import Component
from shaper_fmu.export.native.toolchain import has_toolchain
from shaper_fmu.export.wasm import SHIPPED, is_shipped, ship_modules
from shaper_fmu.live.identified_modes import IdentifiedModes
from shaper_fmu.live.page import page_components, panel_components, plants_of


def has_panel() -> bool:
    """Whether a report's live panel can be written here."""
    return has_toolchain() or all(map(is_shipped, panel_components(IdentifiedModes)))


def shipped_components() -> list[type[Component]]:
    """The components of the live page and of the panels in reports."""
    return list(dict.fromkeys([*page_components(plants_of()), *panel_components(IdentifiedModes)]))


if __name__ == "__main__":
    ship_modules(shipped_components(), SHIPPED)

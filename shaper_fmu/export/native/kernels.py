"""A component's own C files, which its declaration and its kernels become; the FMI layer is the same for all."""

from __future__ import annotations

from shaper_fmu.component import Component
from shaper_fmu.export.c.texts import record_text
from shaper_fmu.export.c.translate import translated
from shaper_fmu.export.kernel_source import check_kernels

_GUARD = "SHAPER_FMU_RECORD_H"


def component_files(component: type[Component]) -> dict[str, str]:
    """record.h, the values of the component, and kernels.c, what is done with them. Raises BuildError for what does not compile."""
    check_kernels(component)
    title = f"/* The values of {component.__name__}: all its variables, in the order of their declaration. */"
    record = f"{title}\n\n#ifndef {_GUARD}\n#define {_GUARD}\n\n#include <stdint.h>\n\n{record_text(component)}\n\n#endif\n"
    return {"record.h": record, "kernels.c": translated(component)}

"""A component's kernel alone as C, for controllers without FMI: a header, a source file and an example that runs."""

from __future__ import annotations

import enum
import math
from pathlib import Path
from typing import Any

from shaper_fmu.archives import write_file
from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import BuildError
from shaper_fmu.export.c.code import literal
from shaper_fmu.export.c.names import ascii_name, c_name
from shaper_fmu.export.c.texts import record_text
from shaper_fmu.export.c.unit import field_name
from shaper_fmu.export.c.writing import inside_comment
from shaper_fmu.export.description_parts import summary
from shaper_fmu.export.native.kernels import component_files
from shaper_fmu.export.packing import check_component

KERNEL_H = Path(__file__).parent / "native" / "kernel.h"
"""The header by hand that kernels need."""

_HEADER = """\
/* {summary}

   {name}_init gives all variables their start values. Then set parameters and inputs, as fields, and call {name}_start
   once; after that set inputs and call {name}_step for each step from t over h [s]: it holds the inputs and sets the outputs to
   their values at t + h. A step of length 0 serves an event. Nothing but the {name} itself is kept: {size} bytes where doubles are
   aligned to 8, and no memory is taken.

   Functions return 0, or the number of a message; a fault of the computation is kept in *fault (fault->what is null without
   one). Compile with -ffp-contract=off, and link the mathematics library. */

#ifndef {guard}
#define {guard}

#include "kernel.h"

#ifdef __cplusplus
extern "C" {{
#endif

{record}
{items}
void {name}_init({name} *self);
int {name}_start({name} *self, double t, Fault *fault);
int {name}_step({name} *self, double t, double h, Fault *fault);
const char *{name}_message(int status);

#ifdef __cplusplus
}}
#endif

#endif
"""

_SOURCE = """\
/* {summary} See {name}.h. */

#define Record {name}
#define kernel_start {name}_kernel_start
#define kernel_step {name}_kernel_step

#include "{name}.h"

#include <string.h>

{kernels}
/* The interface of {name}.h. */

static inline int {name}_is_in(double value, double low, double high) {{ return value >= low && value <= high; }}

static inline int {name}_outside(Fault *fault, const char *name, double value) {{
    set_fault(fault, "value outside of its domain", name, value, 0.0, "");
    return 0;
}}

/* Kernels rely on the domains of parameters and inputs. */
static int {name}_inputs_are_right(const {name} *self, Fault *fault) {{
{inputs}    return self && !fault->what;
}}

static int {name}_parameters_are_right(const {name} *self, Fault *fault) {{
{parameters}    return self && !fault->what;
}}

void {name}_init({name} *self) {{
    memset(self, 0, sizeof *self);
{starts}}}

int {name}_start({name} *self, double t, Fault *fault) {{
    memset(fault, 0, sizeof *fault);
    if (!{name}_parameters_are_right(self, fault) || !{name}_inputs_are_right(self, fault)) return 0;
    int status = kernel_start(self, fault);
    return status || fault->what ? status : kernel_step(self, t, 0.0, fault);
}}

int {name}_step({name} *self, double t, double h, Fault *fault) {{
    memset(fault, 0, sizeof *fault);
    return {name}_inputs_are_right(self, fault) ? kernel_step(self, t, h, fault) : 0;
}}

const char *{name}_message(int status) {{
    switch (status) {{
{messages}        default: return "";
    }}
}}
"""

_EXAMPLE = """\
/* An example: cc -std=c99 -ffp-contract=off {name}_example.c {name}.c -lm */

#include "{name}.h"

#include <stdio.h>

int main(void) {{
    static {name} m; /* {size} bytes: too much for some stacks */
    const double h = {step};
    Fault fault;
    int status;
    {name}_init(&m);
    /* parameters are set here, as fields: m.{parameter} = ...; */
    status = {name}_start(&m, 0.0, &fault);
    for (int i = 0; i < 100 && !status && !fault.what; i++) {{
{given}        status = {name}_step(&m, i * h, h, &fault);
        printf("{formats}\\n", (i + 1) * h, {taken});
    }}
    if (fault.what) printf("%s: %s = %g\\n", fault.what, fault.name, fault.value);
    if (status) printf("%s\\n", {name}_message(status));
    return status || fault.what ? 1 : 0;
}}
"""


def write_c(component: type[Component], folder: Path) -> list[Path]:
    """Write <component>.h and .c, an example and kernel.h into the folder, and return their paths. Raises BuildError."""
    check_component(component)
    name = component.__name__
    if c_name(name) != name:
        raise BuildError(f"{name}: C, its library or kernel.h has this name itself; give the component another one")
    texts = {**plain_c(component), "kernel.h": KERNEL_H.read_text(encoding="utf-8")}
    return [write_file(folder / name, text.encode()) for name, text in texts.items()]


def plain_c(component: type[Component]) -> dict[str, str]:
    """The component's own files by name."""
    name = component.__name__
    variables = list(component.variables.values())
    kernels = component_files(component)["kernels.c"]
    for header in ('#include "kernel.h"\n', '#include "record.h"\n'):
        kernels = kernels.replace(header, "", 1)
    words: dict[str, Any] = {
        "name": name, "summary": inside_comment(summary(component)),
        "guard": f"SHAPER_FMU_{name.upper()}_H", "kernels": kernels.strip() + "\n",
        "record": record_text(component).replace("} Record;", f"}} {name};"), "items": _items(component), "size": _size(variables),
        "starts": "".join(f"    {line}\n" for v in variables for line in _starts(component, v)),
        "inputs": _checks(component, [v for v in variables if v.causality == "input"]),
        "parameters": _checks(component, [v for v in variables if v.causality == "parameter"]),
        "messages": "".join(f"        case {k}: return {literal(text)};\n" for k, text in sorted(component.messages.items())),
    }  # fmt: skip
    return {
        f"{name}.h": _HEADER.format(**words), f"{name}.c": _SOURCE.format(**words),
        f"{name}_example.c": _EXAMPLE.format(**words, **_example_words(component, variables)),
    }  # fmt: skip


def _example_words(component: type[Component], variables: list[Variable[Any]]) -> dict[str, str]:
    given = [v for v in variables if v.causality == "input" and v.kind is float and v.problem(v.scalar_names[0], 1.0) is None]
    taken = [v for v in variables if v.causality == "output" and v.kind is float and v.name != "next_event_time"]
    parameters = [v for v in variables if v.causality == "parameter"]
    return {
        "step": repr(float(component.default_step_size)),
        "parameter": field_name(component, parameters[0].name) if parameters else "name",
        "given": "".join(f"        m.{_first(component, v)} = 1.0;\n" for v in given[:1]),
        "formats": "t = %g" + "".join(f", {v.name} = %.9g" for v in taken),
        "taken": ", ".join(f"m.{_first(component, v)}" for v in taken) or "0",
    }


def _first(component: type[Component], variable: Variable[Any]) -> str:
    return field_name(component, variable.name) + ("" if variable.size is None else "[0]")


def _size(variables: list[Variable[Any]]) -> int:
    size = 0
    for v in variables:
        each = 8 if v.kind is float else 4
        size = -(-size // each) * each + each * (v.size or 1)
    return -(-size // 8) * 8


def _items(component: type[Component]) -> str:
    """The items of the enumerations as constants, such as InputShaper_shaper_zv for the variable `shaper`."""
    lines = []
    for v in component.variables.values():
        if issubclass(v.kind, enum.IntEnum):
            lines.append(f"enum {{ /* values of {v.name} */")
            lines += [
                f"    {component.__name__}_{field_name(component, v.name)}_{ascii_name(item.name)} = {int(item)},"
                for item in v.kind
            ]
            lines[-1] = lines[-1].rstrip(",")
            lines.append("};")
    return "\n" + "".join(f"{line}\n" for line in lines)


def _starts(component: type[Component], variable: Variable[Any]) -> list[str]:
    name = field_name(component, variable.name)
    if variable.size is None:
        return [f"self->{name} = {_number(variable.starts[0])};"] if _is_set(variable.starts[0]) else []
    return [f"self->{name}[{i}] = {_number(value)};" for i, value in enumerate(variable.starts) if _is_set(value)]


def _is_set(value: Any) -> bool:
    """Whether a start value is another than that of memory that holds nothing."""
    return bool(value) or (isinstance(value, float) and math.copysign(1.0, value) < 0.0)


def _number(value: Any) -> str:
    return repr(value) if isinstance(value, float) else str(int(value))


def _checks(component: type[Component], variables: list[Variable[Any]]) -> str:
    """Lines that refuse what is outside of the variables' domains. Bounds that do not belong to a domain are one digit away."""
    lines, owner = [], component.__name__
    for v in variables:
        name, place = field_name(component, v.name), "" if v.size is None else "[i]"
        value = f"self->{name}{place}"
        if issubclass(v.kind, enum.IntEnum):
            right = " || ".join(f"{value} == {int(item)}" for item in v.kind)
        elif v.kind is bool:
            continue
        else:
            right = f"{owner}_is_in({value}, {_bound(v, 'min', v.min)}, {_bound(v, 'max', v.max)})"
            if v.exclusive in (True, "min") and v.min is not None:
                right += f" && {value} > {float(v.min)!r}"
            if v.exclusive in (True, "max") and v.max is not None:
                right += f" && {value} < {float(v.max)!r}"
        test = f"if (!({right})) return {owner}_outside(fault, {literal(v.name)}, {value});"
        lines.append(f"    {test}" if v.size is None else f"    for (int i = 0; i < {v.size}; i++)\n        {test}")
    return "".join(f"{line}\n" for line in lines)


def _bound(variable: Variable[Any], side: str, bound: Any) -> str:
    if bound is not None:
        return repr(float(bound))
    return ("-" if side == "min" else "") + "1.7976931348623157e+308"

"""LLVM IR of a component's kernels, the same on every machine.

numba compiles for the processor that it runs on, once for a process. What is exported must not depend on that
processor, so it is compiled in a process of its own, for the plainest one of its kind.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import BuildError, ShaperFmuError
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.closure import packed_sources, source_file
from shaper_fmu.registry import load_components
from shaper_fmu.search_path import with_search_path

_PLAIN_PROCESSOR = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_DISABLE_JIT": "0", "PYTHONHASHSEED": "0"}


def kernel_files(component: type[Component]) -> dict[str, Path]:
    """Files with the IR that defines kernel_start and kernel_step. Raises BuildError for what does not compile."""
    component = _with_own_kernels(component)
    compiler = Path(__file__).parent.parent / "compile.py"
    root, _ = packed_sources(component)
    key = digest(root, compiler.read_bytes(), version("numba"), version("llvmlite"), sys.version.split(".")[1])
    texts: dict[str, str] = {}

    def text_of(kernel: str) -> bytes:
        if not texts:
            texts.update(_compiled_elsewhere(component))
        return texts[kernel].encode()

    return {kernel: cached("kernels", f"{key}-{kernel}.ll", lambda kernel=kernel: text_of(kernel)) for kernel in ("start", "step")}


def _with_own_kernels(component: type[Component]) -> type[Component]:
    """The component itself, or what it stems from if it changes nothing but start values and the like: the kernels are those."""
    base = component.__mro__[1]
    made = ("variables", "messages", "_real_results", "_slopes", "_layout", "_digest")
    own = [
        name
        for name, value in vars(component).items()
        if not (name.startswith("__") or isinstance(value, Variable) or name in made)
    ]
    if own or not issubclass(base, Component) or base is Component or _layout(base) != _layout(component):
        return component
    return _with_own_kernels(base)


def _compiled_elsewhere(component: type[Component]) -> dict[str, str]:
    arguments = [str(source_file(component)), component.__module__, component.__name__]
    command, environment = with_search_path(f"from {__name__} import answer; answer()")
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, env=environment | _PLAIN_PROCESSOR, check=False)
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        raise BuildError(
            f"{component.__name__}: compiling the kernels ended with status {done.returncode}:\n{done.stderr[-3000:]}"
        ) from None
    if "error" in answer:
        raise BuildError(answer["error"])
    if answer.pop("layout") != _layout(component):  # a library whose parts disagree about its record would crash its host
        raise BuildError(f"{component.__name__}: its source has changed since it was loaded; build it again")
    return answer


def _layout(component: type[Component]) -> str:
    """The fields of the record, as a text."""
    return " ".join(f"{v.name}:{v.code}{v.size or 0}" for v in component.variables.values())


def _main(file: str, module: str, name: str) -> dict[str, str]:
    from importlib import import_module

    from shaper_fmu.export.compile import KERNELS, freestanding_ir

    try:
        if module.startswith("component_"):
            component = next(c for c in load_components(Path(file)) if c.__name__ == name)
        else:
            component = getattr(import_module(module), name)
        kernels = {kernel: freestanding_ir(component, kernel, f"kernel_{kernel}") for kernel in KERNELS}
        return {"layout": _layout(component), **kernels}
    except ShaperFmuError as error:
        return {"error": str(error)}
    except (ImportError, AttributeError, StopIteration) as error:
        words = f"{name} cannot be loaded from {file} to be compiled ({type(error).__name__}: {error})"
        return {"error": f"{words}; define it at the top level of a file of its own, which does the same each time it is loaded"}


def answer() -> None:
    """Write the answer to the standard output, and what the component's file writes there to the standard error."""
    output = os.dup(1)
    os.dup2(2, 1)
    found = json.dumps(_main(*sys.argv[1:]))
    with os.fdopen(output, "w") as stream:
        stream.write(found)

"""The folder sources/ of a native FMU: all C that its libraries are made of, for importers and users who compile it themselves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lxml import etree

from shaper_fmu.component import Component
from shaper_fmu.export.description_parts import COMPILED_SOURCES, as_bytes
from shaper_fmu.export.native.table import component_table

UNIT: str = COMPILED_SOURCES[0]
TABLE = "component.c"
LAYER = "layer.c"
OPTIONS = "-ffp-contract=off"
"""A product and a sum are rounded each, as in Python: a compiler that fuses them gives other last digits."""

_LAYER = ("values.c", "messages.c", "states.c", "life.c", "exchange.c", "derivatives.c")
_VERSIONS = {2: ("fmi2.c",), 3: ("fmi3.c", "fmi3_simulation.c", "fmi3_absent.c")}
_HEADERS = {2: ("kernel.h", "component.h"), 3: ("kernel.h", "component.h", "fmi3.h")}
_WITH_MATH_LIBRARY = ("x86_64-linux", "x86-linux", "aarch64-linux")

_CMAKE = """\
cmake_minimum_required(VERSION 3.15)
project({name} C)

# FMI's headers are not part of an FMU; give their folder: cmake -S sources -B build -DFMI_HEADERS=...
set(FMI_HEADERS "" CACHE PATH "The folder with fmi{fmi}Functions.h")

add_library({name} SHARED {files})
set_target_properties({name} PROPERTIES PREFIX "" C_STANDARD 99 C_VISIBILITY_PRESET hidden)
target_include_directories({name} PRIVATE "${{FMI_HEADERS}}")
if(MSVC)
  target_compile_options({name} PRIVATE /fp:precise)
else()
  target_compile_options({name} PRIVATE {options})
  if(CMAKE_SIZEOF_VOID_P EQUAL 4 AND CMAKE_SYSTEM_PROCESSOR MATCHES "86|AMD64")
    target_compile_options({name} PRIVATE -msse2 -mfpmath=sse)
  endif()
  target_link_libraries({name} PRIVATE m)
endif()
"""

_README = """\
# Sources of {name}, FMI {fmi}.0

C99 that needs the standard library alone (libc, libm); gcc and clang have no warning under -Wall -Wextra -pedantic. Compile
{files} with this folder and the folder of FMI's headers as include folders (fmi{fmi}Functions.h and what it includes;
they belong to the importer):

    cc -std=c99 -O2 {options} -fvisibility=hidden -fPIC -shared -I. -I<FMI headers> {files} -lm -o {name}.so

or `cmake -S . -B build -DFMI_HEADERS=<folder>` and `cmake --build build`.

- {options}: each product and each sum is rounded. A compiler that fuses them (gcc's default outside of -std=c99) changes
  last digits on processors that can. On 32-bit x86 add -msse2 -mfpmath=sse; the compiler refuses the arithmetic of the x87 unit,
  unless you define SHAPER_FMU_ANY_ROUNDING.
- To link several FMUs into one program, define FMI{fmi}_FUNCTION_PREFIX={name}_, and kernel_start and kernel_step as other names
  for each (-Dkernel_start={name}_start -Dkernel_step={name}_step); nothing else has an external name.
- kernels.c is what the component does, translated from its Python; record.h and component.c are its variables; all other files are
  the same in every FMU. Memory is taken at the instantiation and for saved FMU states, never between.
"""


def layer_sources(fmi: int) -> list[Path]:
    """The C files of the generic layer for this version of FMI."""
    return [Path(__file__).parent / name for name in (*_LAYER, *_VERSIONS[fmi])]


def layer_headers(fmi: int) -> list[Path]:
    """The headers that these include, but FMI's own."""
    return [Path(__file__).parent / name for name in _HEADERS[fmi]]


def fmu_sources(component: type[Component], token: str, fmi: int, own: Mapping[str, str]) -> dict[str, str]:
    """The C files by name: the component's `own`, its table, the layer, and the unit that includes all but the kernels."""
    files = {file.name: file.read_text(encoding="utf-8") for file in (*layer_headers(fmi), *layer_sources(fmi))}
    included = _including(TABLE, *(file.name for file in layer_sources(fmi)))
    unit = f"/* All of the FMU but its kernels, as one unit. */\n\n#define ONE_UNIT\n\n{included}"
    return {**files, **own, TABLE: component_table(component, token), UNIT: unit}


def library_sources(sources: Mapping[str, str], fmi: int) -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
    """The same in three parts, each compiled by itself: kernels.c, component.c with the table, and layer.c with all that is the
    same for all components."""
    layer = [file.name for file in layer_sources(fmi)]
    headers = [file.name for file in layer_headers(fmi)]
    parts = (("kernels.c", "record.h", "kernel.h"), (TABLE, "record.h", *headers), (*layer, *headers))
    kernels, table, shared = ({name: sources[name] for name in names} for names in parts)
    return kernels, table, {**shared, LAYER: f"#define LAYER_UNIT\n\n{_including(*layer)}"}


def _including(*names: str) -> str:
    return "".join(f'#include "{name}"\n' for name in names)


def sources_folder(component: type[Component], fmi: int, files: Mapping[str, str]) -> dict[str, bytes]:
    """The folder's content by its path in the FMU: the C files and how to compile them."""
    name = component.__name__
    words = {"name": name, "fmi": fmi, "files": " ".join(COMPILED_SOURCES), "options": OPTIONS}
    texts = {**files, "CMakeLists.txt": _CMAKE.format(**words), "README.md": _README.format(**words)}
    found = {f"sources/{file}": text.encode() for file, text in texts.items()}
    if fmi == 3:
        found["sources/buildDescription.xml"] = _build_description(name)
    return found


def _build_description(name: str) -> bytes:
    """For FMI 3.0: a configuration for all platforms, and one each for those where the mathematics library is a file of its own."""
    root = etree.Element("fmiBuildDescription", fmiVersion="3.0")
    for platform in ("", *_WITH_MATH_LIBRARY):
        told = {"platform": platform} if platform else {"description": "C99 of the standard library alone"}
        configuration = etree.SubElement(root, "BuildConfiguration", {"modelIdentifier": name, **told})
        options = f"{OPTIONS} -msse2 -mfpmath=sse" if platform == "x86-linux" else OPTIONS
        sources = etree.SubElement(configuration, "SourceFileSet", language="C99", compiler="gcc", compilerOptions=options)
        for file in COMPILED_SOURCES:
            etree.SubElement(sources, "SourceFile", name=file)
        if platform:
            etree.SubElement(configuration, "Library", name="m", external="true", description="C's mathematics library")
    return as_bytes(root)

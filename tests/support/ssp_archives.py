"""SSP archives made of a few words, for tests: the standard's prefixes and FMUs of this package."""

from __future__ import annotations

from pathlib import Path

from shaper_fmu.archives import write_archive
from shaper_fmu.ssp.names import PREFIXES

NAMESPACES = " ".join(f'xmlns:{prefix}="{uri}"' for prefix, uri in PREFIXES.items())
UNITS = """<ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>
<ssc:Unit name="kg"><ssc:BaseUnit kg="1"/></ssc:Unit><ssc:Unit name="g"><ssc:BaseUnit kg="1" factor="0.001"/></ssc:Unit>
<ssc:Unit name="N"><ssc:BaseUnit kg="1" m="1" s="-2"/></ssc:Unit><ssc:Unit name="kN"><ssc:BaseUnit kg="1" m="1" s="-2" factor="1000"/></ssc:Unit>
<ssc:Unit name="s"><ssc:BaseUnit s="1"/></ssc:Unit><ssc:Unit name="ms"><ssc:BaseUnit s="1" factor="0.001"/></ssc:Unit>"""


def ssd(root: str, version: str = "1.0", more: str = "", name: str = "test") -> bytes:
    """A description; `root` is what is in the root system."""
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription {NAMESPACES} version="{version}" name="{name}"><ssd:System name="root">
{root}
</ssd:System>{more}<ssd:Units>{UNITS}</ssd:Units><ssd:DefaultExperiment startTime="0" stopTime="1"/>
</ssd:SystemStructureDescription>""".encode()


def ssv(*parameters: str, version: str = "1.0") -> str:
    """A parameter set; each parameter is "name type value" or "name type value unit"."""
    lines = []
    for parameter in parameters:
        name, kind, value, *unit = parameter.split(" ")
        unit_ = f' unit="{unit[0]}"' if unit else ""
        lines.append(f'<ssv:Parameter name="{name}"><ssv:{kind} value="{value}"{unit_}/></ssv:Parameter>')
    body = f"<ssv:Parameters>{chr(10).join(lines)}</ssv:Parameters><ssv:Units>{UNITS}</ssv:Units>"
    return f'<ssv:ParameterSet {NAMESPACES} version="{version}" name="set">{body}</ssv:ParameterSet>'


def binding(*parameters: str, mapping: str = "", prefix: str = "") -> str:
    """A binding with an inline set; `mapping` are the entries of an inline mapping."""
    inner = f"<ssd:ParameterValues>{ssv(*parameters)}</ssd:ParameterValues>"
    if mapping:
        inner += (
            f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">{mapping}</ssm:ParameterMapping></ssd:ParameterMapping>'
        )
    return f'<ssd:ParameterBinding prefix="{prefix}">{inner}</ssd:ParameterBinding>'


def bindings(*found: str) -> str:
    return f"<ssd:ParameterBindings>{''.join(found)}</ssd:ParameterBindings>" if found else ""


def connectors(*found: str) -> str:
    """Connectors, each "name kind" or "name kind unit"."""
    lines = []
    for connector in found:
        name, kind, *unit = connector.split(" ")
        type_ = f'<ssc:Real unit="{unit[0]}"/>' if unit else ""
        lines.append(f'<ssd:Connector name="{name}" kind="{kind}">{type_}</ssd:Connector>')
    return f"<ssd:Connectors>{''.join(lines)}</ssd:Connectors>" if lines else ""


def component(name: str, fmu: str, *bound: str) -> str:
    return f'<ssd:Component name="{name}" source="resources/{fmu}.fmu">{bindings(*bound)}</ssd:Component>'


def connection(start: str, end: str, inner: str = "", **attributes: str) -> str:
    """A connection between "element.connector" or "connector" of the system itself."""
    text = "".join(f' {key}="{value}"' for key, value in attributes.items())
    for side, name in (("start", start), ("end", end)):
        element, dot, connector = name.rpartition(".")
        text += f' {side}Element="{element}"' * bool(dot) + f' {side}Connector="{connector}"'
    return f"<ssd:Connection{text}>{inner}</ssd:Connection>"


def system(interface: str, elements: str, connections: str = "", name: str = "") -> str:
    """The inside of a system, or with a name the whole element."""
    inner = f"{interface}<ssd:Elements>{elements}</ssd:Elements>"
    inner += f"<ssd:Connections>{connections}</ssd:Connections>" if connections else ""
    return f'<ssd:System name="{name}">{inner}</ssd:System>' if name else inner


def linear(factor: float = 1.0, offset: float = 0.0) -> str:
    return f'<ssc:LinearTransformation factor="{factor}" offset="{offset}"/>'


def table(kind: str, **entries: str) -> str:
    """A mapping transformation; the entries are source_... = target, without the "of_" that begins numbers."""
    inner = "".join(
        f'<ssc:MapEntry source="{source.removeprefix("of_")}" target="{target}"/>' for source, target in entries.items()
    )
    return f"<ssc:{kind}MappingTransformation>{inner}</ssc:{kind}MappingTransformation>"


def archive(folder: Path, fmus: Path, description: bytes, *names: str, **files: bytes) -> Path:
    """An archive with FMUs by name and further files (keyword x_ssd is the file x.ssd)."""
    content = {f"resources/{name}.fmu": (fmus / f"{name}.fmu").read_bytes() for name in names}
    more = {key.replace("__", "/").replace("_", "."): value for key, value in files.items()}
    return write_archive(folder / "test.ssp", {"SystemStructure.ssd": description, **content, **more})

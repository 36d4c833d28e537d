"""Validates files offline by the schemas of the SSP standard, versions 1.0 and 2.0, in the folder schema/.

One schema holds the five formats, so that a parameter set, a mapping or a dictionary inside a description is validated, too,
where the description's own schema lets any content pass.
"""

from __future__ import annotations

import functools
import re
from pathlib import Path

from lxml import etree

from shaper_fmu.ssp.names import PREFIXES, USUAL_PREFIXES, VERSIONS
from shaper_fmu.xml_files import parse_xml

FOLDER = Path(__file__).parent / "schema"
_XS = "http://www.w3.org/2001/XMLSchema"
_NAMES = {f"{{{uri}}}": f"{prefix}:" for prefix, uri in PREFIXES.items()}


def schema_problems(content: bytes, file: str) -> list[str]:
    """The findings of the schema of the file's version: "file, line N: message". Raises ArchiveError if it is not readable XML."""
    undeclared: list[str] = []
    root = parse_xml(content, file, prefixes=USUAL_PREFIXES, findings=undeclared)
    version = root.get("version", "")
    major = version.split(".")[0]
    if major not in {known.split(".")[0] for known in VERSIONS}:
        given = f"version {version!r}" if version else "no version"
        return [f"{file}, line {root.sourceline}: {given}; of the SSP standard, versions {' and '.join(VERSIONS)} are known"]
    schema = _schema(major)
    schema.validate(root)
    messages = [f"{file}, {message}" for message in undeclared]
    return messages + [f"{file}, line {error.line}: {_plain(error.message)}" for error in schema.error_log]


@functools.cache
def _schema(major: str) -> etree.XMLSchema:
    folder = FOLDER / f"ssp{major}"
    imports = "".join(f'<xs:import namespace="{uri}" schemaLocation="{uri.rsplit("/", 1)[1]}.xsd"/>' for uri in PREFIXES.values())
    parser = etree.XMLParser(no_network=True)
    driver = etree.fromstring(f'<xs:schema xmlns:xs="{_XS}">{imports}</xs:schema>', parser, base_url=str(folder / "all.xsd"))
    return etree.XMLSchema(driver)


def _plain(message: str) -> str:
    """The validator's message, with the usual prefixes instead of namespaces."""
    for namespace, prefix in _NAMES.items():
        message = message.replace(namespace, prefix)
    return re.sub(r"\s+", " ", message[:1].lower() + message[1:]).removesuffix(".").strip()

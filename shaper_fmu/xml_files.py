"""Reads foreign XML files of limited size, without document types, entities or network access."""

from __future__ import annotations

import re
from collections.abc import Mapping
from xml.parsers import expat

from lxml import etree

from shaper_fmu.errors import ArchiveError

MOST_BYTES = 100_000_000
"""Size of the largest XML file that is parsed; the largest known model descriptions have some tens of millions."""


_PREFIX = re.compile(r"Namespace prefix ([\w.-]+) ")
_ROOT = re.compile(rb"(?s)\A(?:[^<]|<\?.*?\?>|<!--.*?-->)*<[^\s/>]+")


class _PrologEnds(Exception):
    """The first element begins."""


def parse_xml(
    content: bytes,
    name: str,
    encoding: str | None = None,
    prefixes: Mapping[str, str] | None = None,
    findings: list[str] | None = None,
) -> etree._Element:
    """The root element; its elements know their lines. An `encoding` overrides the one in the file.

    Prefixes that are not declared stand for the namespaces of `prefixes`, or one of their own; that goes to `findings`.

    A document type is refused before anything of it is read, since entities are declared in it. libxml2's own limits stay: 256
    levels of elements, 10 million bytes in one text. Raises ArchiveError, which calls the file `name`.
    """
    if len(content) > MOST_BYTES:
        raise ArchiveError(f"{name}: {len(content)} bytes of XML, more than the {MOST_BYTES} that are accepted")
    _refuse_document_type(content, name, encoding)
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True, encoding=encoding
    )
    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        undeclared = _undeclared_prefixes(parser)
        if not undeclared or prefixes is None:
            raise ArchiveError(f"{name}: not well-formed: {error.msg}") from None
        messages = [f"line {line}: the prefix {prefix!r} is not declared" for prefix, line in undeclared.items()]
        declarations = "".join(f' xmlns:{p}="{prefixes.get(p, f"urn:undeclared:{p}")}"' for p in undeclared)
        root = parse_xml(_declared(content, declarations), name, encoding)
        if findings is not None:
            findings += messages
    if root.getroottree().docinfo.doctype:  # in an encoding that the other parser cannot read
        raise _document_type(name)
    return root


def _undeclared_prefixes(parser: etree.XMLParser) -> dict[str, int]:
    """The prefixes that are not declared, with their lines; empty if anything else is wrong, too."""
    errors = [error for error in parser.error_log if error.level >= etree.ErrorLevels.ERROR]
    if any(error.type != etree.ErrorTypes.NS_ERR_UNDEFINED_NAMESPACE for error in errors):
        return {}
    found = ((_PREFIX.match(error.message), error.line) for error in errors)
    return {match[1]: line for match, line in reversed([(m, n) for m, n in found if m is not None])}


def _declared(content: bytes, declarations: str) -> bytes:
    """The file with declarations in its first element."""
    return _ROOT.sub(lambda match: match[0] + declarations.encode(), content, count=1)


def _refuse_document_type(content: bytes, name: str, encoding: str | None) -> None:
    """Read as far as the first element by a parser that stops where a document type begins."""

    def declared(*_of_it: object) -> None:
        raise _document_type(name)

    def begun(*_of_it: object) -> None:
        raise _PrologEnds

    parser = expat.ParserCreate(encoding)
    parser.StartDoctypeDeclHandler = declared
    parser.StartElementHandler = begun
    try:
        parser.Parse(content, True)
    except (_PrologEnds, expat.ExpatError, LookupError, ValueError):  # what is wrong with it is told by the parser that reads it
        return


def _document_type(name: str) -> ArchiveError:
    return ArchiveError(f"{name}: document type declarations (DTD) are not accepted: nothing in these formats needs entities")

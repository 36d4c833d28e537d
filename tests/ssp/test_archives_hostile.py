"""Hostile archives and XML: each is made for real and refused in words, with nothing written and little memory taken."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hostile_archives import HOSTILE, PLAIN, Part, deflated, hostile_zip, zeros

from shaper_fmu.archives import extract_archive, read_archive, write_archive
from shaper_fmu.errors import ArchiveError
from shaper_fmu.master.fmu import fmu_problems, load_fmu
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.xml_files import parse_xml

SSD = b'<x xmlns="http://ssp-standard.org/SSP1/SystemStructureDescription"/>'


def everything(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_archives_are_refused_in_words_and_nothing_is_written(name, tmp_path):
    content, words = HOSTILE[name]
    with pytest.raises(ArchiveError, match=r"^bad\.fmu: .*" + words):
        extract_archive(content, "bad.fmu", tmp_path / "deep" / "target")
    assert everything(tmp_path) == []


@pytest.mark.parametrize("name", ["parent folder", "symbolic link", "overlapping entries", "more than it tells", "encrypted"])
@pytest.mark.parametrize("read", [load_fmu, fmu_problems, load_ssp], ids=["load_fmu", "check", "load_ssp"])
def test_every_way_to_read_a_file_refuses_them_and_leaves_no_folder(name, read, tmp_path, monkeypatch):
    content, words = HOSTILE[name]
    drafts = tmp_path / "drafts"
    drafts.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(drafts))
    (tmp_path / "bad.ssp").write_bytes(content)
    with pytest.raises(ArchiveError, match=words):
        read(tmp_path / "bad.ssp")
    assert everything(tmp_path) == ["bad.ssp", "drafts"]


def test_hostile_archives_take_little_memory(tmp_path):
    """In a process of its own with 100 MB above what it has: half a gigabyte behind a header that tells ten bytes; and twice as many entries as are accepted."""
    bomb = deflated(bytes(1 << 29))
    lying = hostile_zip(Part("a", bytes(1000), told_size=10))
    packed = deflated(bytes(1000))
    (tmp_path / "a.fmu").write_bytes(_with_packed(lying, packed, bomb))
    many = hostile_zip(*[Part(f"{i}", method=0) for i in range(20_000)])
    (tmp_path / "b.fmu").write_bytes(many)
    code = (
        "import resource, sys; from pathlib import Path\n"
        "from shaper_fmu.archives import read_archive, read_file\n"
        "from shaper_fmu.errors import ArchiveError\n"
        "used = int(next(l for l in open('/proc/self/status') if l.startswith('VmSize')).split()[1]) * 1024\n"
        "resource.setrlimit(resource.RLIMIT_AS, (used + 100_000_000,) * 2)\n"
        "for name in sys.argv[1:]:\n"
        "    try: read_archive(read_file(Path(name)), 'x')\n"
        "    except ArchiveError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, "a.fmu", "b.fmu"], capture_output=True, text=True, cwd=tmp_path, check=True)
    lines = done.stdout.splitlines()
    assert lines[0] == "x: entry 'a' unpacks to more than the 10 bytes that it declares"
    assert lines[1] == "x: 20000 entries, more than the 10000 that are accepted"


def _with_packed(archive: bytes, old: bytes, new: bytes) -> bytes:
    """The archive of one entry with other packed bytes: sizes and places are set anew in both headers."""
    begin = archive.index(old)
    head, tail = bytearray(archive[:begin]), bytearray(archive[begin + len(old) :])
    head[18:22] = len(new).to_bytes(4, "little")
    tail[20:24] = len(new).to_bytes(4, "little")
    end = tail.index(b"PK\5\6")
    tail[end + 16 : end + 20] = (begin + len(new)).to_bytes(4, "little")
    return bytes(head) + new + bytes(tail)


# Archives in archives


def test_fmus_in_a_system_are_judged_by_what_they_unpack_to_together():
    """Each of them would pass: 8 FMUs of 150 MB, of which no byte is unpacked."""
    fmu = hostile_zip(Part("a", b"x" * 700_000, method=0), Part("b", bytes(100), told_size=150_000_000))
    content = hostile_zip(Part("SystemStructure.ssd", SSD), *[Part(f"resources/{i}.fmu", fmu, method=0) for i in range(8)])
    with pytest.raises(ArchiveError, match=r"^x\.ssp: the archives in it unpack to more than the 1073741824 bytes"):
        read_archive(content, "x.ssp")


def test_systems_may_be_nested_once():
    inner = hostile_zip(Part("SystemStructure.ssd", SSD))
    middle = hostile_zip(Part("SystemStructure.ssd", SSD), Part("resources/inner.ssp", inner))
    outer = hostile_zip(Part("SystemStructure.ssd", SSD), Part("resources/middle.SSP", middle))
    assert read_archive(middle, "x.ssp")["resources/inner.ssp"] == inner
    with pytest.raises(
        ArchiveError, match=r"x\.ssp/resources/middle\.SSP: holds a system's archive again; they may be nested once"
    ):
        read_archive(outer, "x.ssp")


def test_a_hostile_fmu_in_a_system_is_refused_where_the_system_uses_it(fmus, tmp_path, monkeypatch):
    """With the place in the system; and nothing of it stays on the disk."""
    text = (
        '<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="x">'
        '\n<ssd:System name="x"><ssd:Elements>\n<ssd:Component name="bad" source="resources/bad.fmu"/>'
        "</ssd:Elements></ssd:System></ssd:SystemStructureDescription>"
    )
    hostile = hostile_zip(PLAIN, Part("../outside.txt"))
    archive = write_archive(tmp_path / "x.ssp", {"SystemStructure.ssd": text.encode(), "resources/bad.fmu": hostile})
    drafts = tmp_path / "drafts"
    drafts.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(drafts))
    with pytest.raises(Exception, match=r"SystemStructure\.ssd, line 3: .*bad\.fmu: .*outside the target folder"):
        load_ssp(archive)
    assert everything(tmp_path) == ["drafts", "x.ssp"]


# XML

LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))
XML = {
    "billion laughs": (f'<!DOCTYPE x [<!ENTITY l0 "ha">{LAUGHS}]><x>&l9;</x>'.encode(), r"document type declarations \(DTD\)"),
    "laughs in an attribute": (f'<!DOCTYPE x [<!ENTITY l0 "ha">{LAUGHS}]><x a="&l9;"/>'.encode(), "document type declarations"),
    "external entity": (b'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><x>&e;</x>', "document type declarations"),
    "parameter entity": (b'<!DOCTYPE x [<!ENTITY % e SYSTEM "http://127.0.0.1:9/e.dtd"> %e;]><x/>', "document type declarations"),
    "external DTD": (b'<!DOCTYPE x SYSTEM "http://127.0.0.1:9/x.dtd"><x/>', "document type declarations"),
    "in UTF-16": ('<!DOCTYPE x [<!ENTITY e "e">]><x>&e;</x>'.encode("utf-16"), "document type declarations"),
    "in EBCDIC": (
        '<?xml version="1.0" encoding="cp037"?><!DOCTYPE x [<!ENTITY e "e">]><x>&e;</x>'.encode("cp037"),
        "document type|not well-formed",
    ),
    "after a comment": (b"<?xml version='1.0'?><!-- a --><?pi?><!DOCTYPE x><x/>", "document type declarations"),
    "undeclared entity": (b"<x>&nowhere;</x>", "not well-formed: Entity 'nowhere' not defined"),
    "huge depth": (b"<a>" * 100_000 + b"</a>" * 100_000, "not well-formed: Excessive depth in document: 256"),
    "huge text": (b"<a>" + b"x" * 11_000_000 + b"</a>", "not well-formed: .*Text node too long"),
    "huge attribute": (b'<a b="' + b"x" * 11_000_000 + b'"/>', "not well-formed: .*limit exceeded"),
    "huge file": (b"<a>" + b"<b/>" * 25_000_001 + b"</a>", "100000011 bytes of XML, more than the 100000000 that are accepted"),
    "cut": (b"<a><b>", "not well-formed"),
    "no XML": (b"\0\1\2", "not well-formed"),
    "empty": (b"", "not well-formed"),
}


@pytest.mark.parametrize("name", XML)
def test_hostile_xml_is_refused_in_words(name):
    content, words = XML[name]
    with pytest.raises(ArchiveError, match=rf"^x\.xml: {words}"):
        parse_xml(content, "x.xml")


def test_other_xml_is_read_with_its_lines():
    root = parse_xml(
        "<?xml version='1.0' encoding='utf-16'?>\n<!-- <!DOCTYPE x> -->\n<a>\n<b>é &amp; <![CDATA[<!DOCTYPE]]></b></a>".encode(
            "utf-16"
        ),
        "x",
    )
    assert [(node.tag, node.sourceline, node.text) for node in root] == [("b", 4, "é & <!DOCTYPE")]


@pytest.mark.parametrize("name", ["billion laughs", "external entity", "huge depth"])
def test_a_model_description_is_read_as_carefully(name, tmp_path):
    content, words = XML[name]
    path = write_archive(tmp_path / "bad.fmu", {"modelDescription.xml": content})
    for read in (load_fmu, fmu_problems):
        with pytest.raises(ArchiveError, match=rf"bad\.fmu: .*modelDescription\.xml: {words}"):
            read(path)


def test_zeros_that_models_may_have_are_accepted():
    """10 MB of zeros pack to a thousandth; a table of zeros is no bomb."""
    assert read_archive(hostile_zip(zeros(9_000_000)), "x.fmu") == {"zeros": bytes(9_000_000)}

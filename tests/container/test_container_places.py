"""Where a container finds what is inside, and what it says of what is damaged or missing there."""

from __future__ import annotations

import ctypes
import os
import random
import re
import shutil
import struct
import subprocess
from collections.abc import Callable
from ctypes import byref, c_void_p
from pathlib import Path
from urllib.parse import quote

import pytest
from container_host import ContainerHost, container_of, copied, library_of, loaded
from native_calls import ERROR, LOGGER2, LOGGER3, Callbacks2
from native_drivers import unpacked
from native_host import host_program, token_of

from shaper_fmu.container.serialize import checksum

both_versions = pytest.mark.parametrize("fmi", [2, 3])
SYSTEM = "resources/container/system.bin"


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("containers")


def instance_of(fmu: Path, library: Path, location: str | None, logs: bool = True) -> tuple[bool, list[str]]:
    """Whether an instance is made by a library that is told this location of the resources, and what it says."""
    said: list[str] = []

    def log2(environment, name, status, category, template, text):
        said.append(text.decode())

    def log3(environment, status, category, text):
        said.append(text.decode())

    fmi = 2 if b"guid" in (unpacked(fmu) / "modelDescription.xml").read_bytes() else 3
    called, token, told = loaded(library, fmi), token_of(fmu).encode(), location.encode() if location is not None else None
    if fmi == 2:
        logger = LOGGER2(log2)
        functions = Callbacks2(logger=ctypes.cast(logger, c_void_p)) if logs else Callbacks2()
        made = called.fmi2Instantiate(b"one", 1, token, told, byref(functions), 0, 1)
        free = called.fmi2FreeInstance
    else:
        logger3 = LOGGER3(log3) if logs else None
        made = called.fmi3InstantiateCoSimulation(b"one", token, told, False, True, False, False, None, 0, None, logger3, None)
        free = called.fmi3FreeInstance
    if made:
        free(made)
    return bool(made), said


# the location


FORMS: dict[str, Callable[[Path], str]] = {
    "file:///": lambda path: f"file://{quote(str(path))}",
    "file:/": lambda path: f"file:{quote(str(path))}",
    "file://localhost/": lambda path: f"file://localhost{quote(str(path))}",
    "FILE:///": lambda path: f"FILE://{quote(str(path))}",
    "without escapes": lambda path: f"file://{path}",
    "escapes in small letters": lambda path: "file://" + re.sub("%..", lambda found: found[0].lower(), quote(str(path))),
    "a path": str,
    "with a slash at the end": lambda path: f"file://{quote(str(path))}/",
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", ["plain", "with two spaces", "gr\u00fc\u00dfe \u65e5\u672c", "50+1&x#y=z"])
def test_a_location_in_any_form(form, name, folder, tmp_path):
    """The library is elsewhere, so that nothing else than the location leads to the resources."""
    fmu = container_of("shaped2", 2, folder)
    resources = copied(fmu, tmp_path / name) / "resources"
    alone = Path(shutil.copy(library_of(unpacked(fmu)), tmp_path / "alone.so"))
    assert instance_of(fmu, alone, FORMS[form](resources)) == (True, [])


def test_a_name_with_a_percent_sign_is_escaped_itself(folder, tmp_path):
    fmu = container_of("shaped2", 2, folder)
    resources = copied(fmu, tmp_path / "a%20b") / "resources"
    alone = Path(shutil.copy(library_of(unpacked(fmu)), tmp_path / "alone.so"))
    assert instance_of(fmu, alone, f"file://{quote(str(resources))}") == (True, [])
    assert "a%2520b" in quote(str(resources))


@both_versions
@pytest.mark.parametrize(
    "location", [None, "", "file:///nowhere/resources", "nowhere", "file:", "%", "http://somewhere/x", "x" * 5000]
)
def test_a_wrong_location_does_no_harm_where_the_library_is_in_its_fmu(location, fmi, folder, tmp_path):
    fmu = container_of("shaped2", fmi, folder)
    assert instance_of(fmu, library_of(copied(fmu, tmp_path / "fmu")), location) == (True, [])


@both_versions
def test_a_library_that_is_loaded_by_a_relative_path_finds_its_resources(fmi, folder, tmp_path, monkeypatch):
    fmu = container_of("shaped2", fmi, folder)
    own = copied(fmu, tmp_path / "fmu")
    monkeypatch.chdir(own)
    assert instance_of(fmu, library_of(own).relative_to(own), None) == (True, [])


@both_versions
@pytest.mark.parametrize("location", [None, "", "file:///nowhere/resources", "nowhere", "file:///%00", "x" * 5000])
def test_without_resources_there_is_no_instance(location, fmi, folder, tmp_path):
    fmu = container_of("shaped2", fmi, folder)
    alone = Path(shutil.copy(library_of(unpacked(fmu)), tmp_path / "alone.so"))
    made, said = instance_of(fmu, alone, location)
    assert not made
    assert len(said) == 1
    assert "cannot read" in said[0] or "the host tells no resources" in said[0]
    assert instance_of(fmu, alone, location, logs=False) == (False, [])


@both_versions
def test_resources_that_cannot_be_written_to_are_enough(fmi, folder, tmp_path):
    fmu = container_of("lag2", fmi, folder)
    own = copied(fmu, tmp_path / "fmu")
    for path in [*own.rglob("*"), own]:
        path.chmod(0o555)
    assert instance_of(fmu, library_of(own), str(own / "resources")) == (True, [])
    for path in [own, *own.rglob("*")]:
        path.chmod(0o755)


# what is damaged


def refused(fmu: Path, folder: Path, change: Callable[[bytes], bytes]) -> str:
    """What an instance says of a changed system; none is made."""
    own = folder if folder.exists() else copied(fmu, folder)
    content = (unpacked(fmu) / SYSTEM).read_bytes()
    (own / SYSTEM).write_bytes(change(content))
    made, said = instance_of(fmu, library_of(own), None)
    assert not made
    assert len(said) == 1
    return said[0]


def summed(content: bytes) -> bytes:
    """With the right checksum."""
    return content[:-8] + struct.pack("<Q", checksum(content[:-8]))


@both_versions
def test_a_flipped_bit_is_seen(fmi, folder, tmp_path):
    fmu, chosen = container_of("shaped2", fmi, folder), random.Random(f"bits {fmi}")
    for _ in range(100):

        def flipped(content: bytes) -> bytes:
            changed = bytearray(content)
            changed[chosen.randrange(len(changed))] ^= 1 << chosen.randrange(8)
            return bytes(changed)

        assert "is damaged" in refused(fmu, tmp_path / "fmu", flipped)


def test_two_flipped_signs_are_seen(folder, tmp_path):
    """Plain FNV-1a over words would not: the highest bit of a word changes the highest bit of the sum alone."""

    def flipped(content: bytes) -> bytes:
        changed = bytearray(content)
        changed[803] ^= 0x80
        changed[1607] ^= 0x80
        return bytes(changed)

    assert "is damaged" in refused(container_of("shaped2", 2, folder), tmp_path / "fmu", flipped)


@both_versions
def test_a_cut_system_is_seen_with_a_right_checksum_too(fmi, folder, tmp_path):
    fmu, chosen = container_of("shaped2", fmi, folder), random.Random(f"cuts {fmi}")
    words = len((unpacked(fmu) / SYSTEM).read_bytes()) // 8
    for keep in [0, 8, 16, 24, *[8 * chosen.randrange(3, words - 1) for _ in range(60)]]:
        said = refused(fmu, tmp_path / "fmu", lambda content, keep=keep: content[: keep + 3])
        assert "is damaged" in said
        if keep >= 24:
            said = refused(fmu, tmp_path / "fmu", lambda content, keep=keep: summed(content[: keep + 8]))
            assert "makes no sense" in said


def test_another_version_is_told(folder, tmp_path):
    def other(content: bytes) -> bytes:
        return summed(content[:8] + struct.pack("<Q", 1) + content[16:])

    assert "belongs to another version" in refused(container_of("shaped2", 2, folder), tmp_path / "fmu", other)


def test_huge_counts_are_no_reason_to_crash(folder, tmp_path):
    """Each word in turn is a number that no count, place or size can be; those that are values or references stay as they are."""
    fmu = container_of("shaped2", 2, folder)
    own, content = copied(fmu, tmp_path / "fmu"), (unpacked(fmu) / SYSTEM).read_bytes()
    begin = 8 * 5  # behind the name, the token and the step
    for at in range(begin, 8 * 40, 8):
        (own / SYSTEM).write_bytes(summed(content[:at] + struct.pack("<Q", 1 << 62) + content[at + 8 :]))
        made, said = instance_of(fmu, library_of(own), None)
        assert made or said


def test_another_token_is_told(folder, tmp_path):
    one, other = container_of("shaped2", 2, folder), container_of("lag2", 2, folder)
    own = copied(one, tmp_path / "fmu")
    shutil.rmtree(own / "resources")
    shutil.copytree(unpacked(other) / "resources", own / "resources")
    made, said = instance_of(one, library_of(own), None)
    assert not made
    assert "do not belong to this description" in said[0]


# the FMUs inside


@both_versions
def test_a_missing_library_inside_is_told(fmi, folder, tmp_path):
    fmu = container_of("mixed", fmi, folder)
    own = copied(fmu, tmp_path / "fmu")
    (library,) = (own / "resources/container").glob("*InputShaper/binaries/*/*.so")
    library.unlink()
    made, (said,) = instance_of(fmu, library_of(own), None)
    assert not made
    assert re.search(r"shaper cannot be loaded: .*InputShaper has no library for this platform", said)
    library.write_bytes(b"no library")
    made, (said,) = instance_of(fmu, library_of(own), None)
    assert not made
    assert "shaper cannot be loaded" in said
    shutil.rmtree(own / "resources/container/0_MotionProfile")
    made, (said,) = instance_of(fmu, library_of(own), None)
    assert not made
    assert "profile cannot be loaded" in said


@pytest.mark.parametrize("version", [2, 3])
def test_a_function_that_a_library_lacks_is_named(version, folder, tmp_path):
    """At the instantiation, or when it is called; never a crash."""
    fmu = container_of(f"faulty{version}", 2, folder)
    names = {2: ["Instantiate", "SetupExperiment", "EnterInitializationMode", "DoStep", "GetReal", "SetInteger", "FreeInstance"],
             3: ["InstantiateCoSimulation", "EnterInitializationMode", "DoStep", "GetFloat64", "UpdateDiscreteStates", "FreeInstance"]}  # fmt: skip
    for name in names[version]:
        own = copied(fmu, tmp_path / name)
        (library,) = (own / "resources/container").glob("*/binaries/*/*.so")
        function = f"fmi{version}{name}".encode()
        found = library.read_bytes()
        assert function + b"\0" in found
        library.write_bytes(found.replace(function + b"\0", function[:-1] + b"_\0"))
        made, said = instance_of(fmu, library_of(own), None)
        if made and name != "FreeInstance":
            host = ContainerHost(fmu, folder=own)
            assert host.setup() == ERROR
            said = [text for _, text in host.log]
            host.free()
        assert name == "FreeInstance" or any(function.decode() in text for text in said), (name, said)


# the host


@both_versions
def test_without_a_logger_all_is_silent(fmi, folder):
    fmu = container_of("shaped2", fmi, folder)
    host = ContainerHost(fmu)
    token, made = host.token, None
    host.free()
    if fmi == 2:
        made = host.library.fmi2Instantiate(b"silent", 1, token, None, byref(Callbacks2()), 0, 1)
    else:
        made = host.library.fmi3InstantiateCoSimulation(
            b"silent", token, None, False, True, False, False, None, 0, None, None, None
        )
    host.instance = made
    assert host.call("Terminate") == ERROR
    assert host.standard_run()
    assert host.log == []
    host.free()


def rounded(fmu: Path, fmi: int, mode: str) -> list[str]:
    host = ContainerHost(fmu)
    places = {v.name: str(v.valueReference) for v in host.variables}
    host.free()
    command = [
        host_program("rounding.c"),
        library_of(host.folder),
        str(fmi),
        token_of(fmu),
        places["shaper.command"],
        places["plant.position"],
        mode,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@both_versions
def test_a_hosts_own_arithmetic_is_kept_and_changes_nothing(fmi, folder):
    """Rounding down, up, to zero; denormal numbers flushed, and taken for zero; traps (all but that of inexact results)."""
    fmu = container_of("shaped3", fmi, folder)
    *expected, kept = rounded(fmu, fmi, "1f80")
    assert kept == "1"
    assert len(set(expected)) > 30
    for mode in ("3f80", "5f80", "7f80", "9f80", "1fc0", "1000"):
        assert rounded(fmu, fmi, mode) == [*expected, "1"], mode


# memory


def resident(fmu: Path, fmi: int, instances: int, states: int) -> list[int]:
    """Kilobytes before and after so many instances, and so many states."""
    command = [host_program("memory.c"), library_of(unpacked(fmu)), str(fmi), token_of(fmu), str(instances), str(states)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return list(map(int, done.stdout.split()))


@pytest.mark.skipif(
    "libasan" in os.environ.get("LD_PRELOAD", ""), reason="AddressSanitizer holds back what is freed, so that memory grows"
)
@pytest.mark.parametrize(("instances", "states"), [(500, 1_000), pytest.param(100_000, 20_000, marks=pytest.mark.thorough)])
@both_versions
def test_memory_stays_flat(fmi, instances, states, folder, capsys):
    """A life of this container takes some 40 kB, its state 4 kB; 24 bytes lost in each of 100,000 would be 2.4 MB. No file stays open."""
    found = resident(container_of("shaped2", fmi, folder), fmi, instances, states)
    with capsys.disabled():
        print(
            f"\ncontainer of FMI {fmi}: {instances} instances {found[0]} -> {found[1]} kB, {states} states {found[2]} -> {found[3]} kB"
        )
    assert found[1] - found[0] < 1000
    assert found[3] - found[2] < 1000

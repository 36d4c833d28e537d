"""Containers cannot be broken by calls: what is illegal is refused in words and changes nothing, what is legal is done."""

from __future__ import annotations

import ctypes
import os
from ctypes import byref, c_void_p
from functools import lru_cache
from pathlib import Path

import pytest
from container_host import KINDS, ContainerFuzzer, ContainerHost, container_of
from native_calls import ERROR, OK, null_call
from native_host import signatures

both_versions = pytest.mark.parametrize("fmi", [2, 3])
every_kind = pytest.mark.parametrize("kind", KINDS)
CALLS = 500 if "libasan" in os.environ.get("LD_PRELOAD", "") else 1500


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("containers")


@lru_cache
def foreign_states(folder: Path, fmi: int) -> list[int]:
    """States of instances of another container, and of a container of the same system."""
    found = []
    for kind in ("lag2", "shaped2"):
        host, place = ContainerHost(container_of(kind, fmi, folder)), c_void_p()
        assert host.call("GetFMUState" if fmi == 3 else "GetFMUstate", byref(place)) == OK
        assert place.value
        found.append(place.value)
    return found


@pytest.mark.representatives(kind=["mixed", "faulty3"])
@every_kind
@both_versions
def test_random_calls_are_done_or_refused_as_the_standard_says(kind, fmi, folder):
    for events, early in [(False, False)] if fmi == 2 else [(False, False), (True, False), (True, True)]:
        host = ContainerHost(container_of(kind, fmi, folder), events, early=early)
        goes_far = KINDS[kind].step is None and "shaped" in kind  # others have events inside for ever, or grow
        ContainerFuzzer(host, f"{kind}/{fmi}/{events}/{early}", foreign_states(folder, fmi), goes_far).run(CALLS)
        host.free()


@both_versions
def test_a_null_instance_is_an_error_for_every_function(fmi, folder):
    library = ContainerHost(container_of("shaped2", fmi, folder)).library
    for function, (result, arguments) in signatures(fmi).items():
        if result is ctypes.c_int:
            assert null_call(library, fmi, function) == ERROR, function
        elif arguments:
            assert null_call(library, fmi, function) is None, function

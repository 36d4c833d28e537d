"""FMUs that change the state of their process: the numbers are those of FMUs that do not, and all is as it was afterwards."""

from __future__ import annotations

import json
import platform
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import fmpy
import pytest
from faulty_fmus import library

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="what the FMU changes is Linux's and this processor's"
)

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="disturbing" guid="{disturbing}">
  <CoSimulation modelIdentifier="disturbing2" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="input" valueReference="0" causality="input" variability="continuous"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="sum" valueReference="1" causality="output" variability="continuous"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies=""/></Outputs>
    <InitialUnknowns><Unknown index="2" dependencies=""/></InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""
_WHATS = """
    directory locale upward zero flush denormals traps precision umask interrupt pipe handlers alarm handledalarm mask redirect
    nonblock environment close
"""
CALLS = ("instantiate", "setup", "set", "enter", "get", "exit", "step", "free")


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    """The FMU."""
    made = library("disturbing2")
    path = tmp_path_factory.mktemp("disturbing") / "disturbing.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(made, f"binaries/{fmpy.platform}/{made.name}")
    return path


# Runs a chain of a disturbing and a well-behaved instance for each name, twice; tells the numbers' bits, and what differs afterwards.
PROGRAM = """
import ctypes, hashlib, json, locale, os, signal, sys, time
import numpy as np
from shaper_fmu.master.arithmetic import arithmetic_mode, set_arithmetic_mode
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
path, names = sys.argv[1], sys.argv[2:]
libc = ctypes.CDLL(None)
libc.getenv.restype = ctypes.c_char_p

def action(number):
    buffer = ctypes.create_string_buffer(256)
    libc.sigaction(number, None, buffer)
    return buffer.raw[:16].hex()

def state():
    mask = os.umask(0o22)
    os.umask(mask)
    files = []
    for file in range(3):
        try:
            found = os.fstat(file)
            files.append((found.st_dev, found.st_ino, os.get_blocking(file)))
        except OSError:
            files.append(None)
    return {
        "directory": os.getcwd(), "locale": locale.setlocale(locale.LC_ALL), "arithmetic": hex(arithmetic_mode() & 0xffff0000ffc0),
        "umask": mask, "files": files, "actions": [action(n) for n in range(1, 32)], "mask": str(signal.pthread_sigmask(0, ())),
        "python": repr(signal.getsignal(2)), "timers": [signal.getitimer(n)[0] for n in (0, 1)], "errors": np.geterr(),
        "environment": {n: str(libc.getenv(n.encode())) for n in ("HOME", "TZ", "DISTURBED")},
    }

set_arithmetic_mode(0x37f00001f80)
told = {}
os.environ["HOME"] = os.environ.get("HOME", "/root")
before = state()
for name in names:
    system = System()
    system.add(name, path, input=1.0)
    system.add("other", path)
    system.connect(f"{name}.sum", "other.input", gain=1 / 7)
    found = hashlib.sha256()
    with Simulation(system) as simulation:
        for _ in range(2):
            results = simulation.run(30.0, 0.1)
            found.update(results.time.tobytes() + b"".join(column.tobytes() for column in results.values.values()))
            inside = state()
    after = state()
    differs = {key: (before[key], after[key]) for key in before if before[key] != after[key]}
    inner = "directory", "umask", "files", "locale", "python", "mask"
    late = {key: (before[key], inside[key]) for key in inner if before[key] != inside[key]}
    told[name] = [found.hexdigest(), differs, late, results.notes]
time.sleep(0.3)
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def answers(path, tmp_path_factory) -> dict[str, Any]:
    """The output of one process for all of them, one after the other: what one leaves behind shows in those after it, too."""
    names = ["none_step", *[f"{what}_{call}" for what in _WHATS.split() for call in CALLS]]
    command = [sys.executable, "-c", PROGRAM, str(path), *names]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path_factory.mktemp("process"))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("what", _WHATS.split())
def test_nothing_of_it_is_left_and_the_numbers_are_the_same(answers, what):
    undisturbed = answers["none_step"]
    assert undisturbed[3] == []
    for name in [f"{what}_{call}" for call in CALLS]:
        digest, differs, late, _ = answers[name]
        assert (name, differs) == (name, {})
        assert (name, late) == (name, {})
        assert (name, digest) == (name, undisturbed[0])

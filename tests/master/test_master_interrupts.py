"""Ctrl-C during a run: it ends at once, the instances are freed, and the command line says so by its exit code."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import zipfile

import pytest
from faulty_fmus import FAULTS, faulty_fmu

INTERRUPTED = """
import sys
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
system = System()
system.add("x", sys.argv[1], {"input": 0.0, "count_in": 0, "flag_in": False, "fault": int(sys.argv[2])})
try:
    with Simulation(system, record=["x.output"]) as simulation:
        simulation.run(1e6, 0.1, progress=lambda t: print("going", flush=True))
except KeyboardInterrupt:
    print("interrupted", simulation.instances["x"].usable, flush=True)
"""


def interrupt(process: subprocess.Popen[str]) -> tuple[str, str]:
    """Send Ctrl-C to a process that has written its first line."""
    assert process.stdout is not None
    process.stdout.readline()
    os.kill(process.pid, signal.SIGINT)
    return process.communicate(timeout=900)


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT cannot be sent to another process there")
@pytest.mark.parametrize("fault", ["slow", "none"])
def test_a_long_run_can_be_interrupted_and_frees_its_instances(fault):
    """A slow FMU takes 20 ms for a step: the run of 1e7 steps would take two days."""
    command = [sys.executable, "-c", INTERRUPTED, str(faulty_fmu(2)), str(FAULTS[fault])]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        out, errors = interrupt(process)
    assert out.splitlines()[-1].removeprefix("going") == "interrupted False"  # it may come between a word and its line's end
    assert errors.splitlines() == (["freed"] if fault == "slow" else [])


STRUCTURE = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="1.0" name="slow" xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
  xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
  <ssd:System name="slow"><ssd:Elements>
    <ssd:Component name="x" source="resources/faulty.fmu">
      <ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>
        <ssv:ParameterSet version="1.0" name="start"><ssv:Parameters>
          <ssv:Parameter name="input"><ssv:Real value="0.0"/></ssv:Parameter>
          <ssv:Parameter name="count_in"><ssv:Integer value="0"/></ssv:Parameter>
          <ssv:Parameter name="flag_in"><ssv:Boolean value="false"/></ssv:Parameter>
          <ssv:Parameter name="fault"><ssv:Integer value="{fault}"/></ssv:Parameter>
        </ssv:Parameters></ssv:ParameterSet>
      </ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>
    </ssd:Component>
  </ssd:Elements></ssd:System>
</ssd:SystemStructureDescription>
"""


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT cannot be sent to another process there")
def test_the_command_line_ends_with_130_when_interrupted(tmp_path):
    with zipfile.ZipFile(tmp_path / "slow.ssp", "w") as archive:
        archive.writestr("SystemStructure.ssd", STRUCTURE.format(fault=FAULTS["slow"]))
        archive.write(faulty_fmu(2), "resources/faulty.fmu")
    # the first line of output tells that the run has begun: progress is reported from inside of it
    program = (
        "from shaper_fmu.master.simulation import Simulation\n"
        "from shaper_fmu.cli.main import main\n"
        "initialize = Simulation._initialize\n"
        "def begun(*arguments):\n"
        "    initialize(*arguments)\n"
        "    print('begun', flush=True)\n"
        "Simulation._initialize = begun\n"
        "main()\n"
    )
    arguments = ["run", str(tmp_path / "slow.ssp"), "--stop-time", "1e6", "--step", "0.1"]
    command = [sys.executable, "-c", program, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        _, errors = interrupt(process)
    assert process.returncode == 130
    assert "freed" in errors
    assert "Traceback" not in errors

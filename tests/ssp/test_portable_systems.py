"""The systems of ssp/ in other people's masters: libcosim and ecos run them as they are; fmpy.ssp deviates, and this is how."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from other_masters import Job, run_jobs
from test_native_interoperability import PACKAGES, require
from test_native_interoperability import pytestmark as where_the_masters_run

from shaper_fmu import System
from shaper_fmu.archives import read_archive
from shaper_fmu.master.fmu import fmu_from_bytes
from shaper_fmu.ssp.archive import load_ssp, pack_ssp
from shaper_fmu.ssp.check import check_ssp
from shaper_fmu.ssp.portable import ECOS, FMPY, LIBCOSIM, OMSIMULATOR, uses

ROOT = Path(__file__).parents[2]
# what is recorded does not pass inputs on at once: ecos reads outputs after it has set the next inputs
RECORDED = {
    "disturbed_stage": ["stage.position[1]", "stage.position[2]", "stage.position[3]"],
    "double_pendulum_range": ["shaper.shaped_mean", "crane.hook_offset", "crane.load_offset", "crane.load_position"],
    "operator_crane": ["drive.speed", "drive.acceleration_mean", "crane.trolley_position", "crane.swing_angle"],
    "overhead_crane": ["shaper.shaped_mean", "crane.trolley_position", "crane.swing_angle", "crane.load_position"],
    "partial_modes_three_mass": ["chain.position[1]", "chain.position[3]", "chain.velocity[1]"],
    "pwm_mass_spring": ["train.pulse", "plant.position", "plant.velocity"],
    "s_curve_beam": ["profile.acceleration", "beam.base_position", "beam.tip_deflection"],
    "two_part_pendulum": ["profile.position", "arm.slide_position", "arm.swing_angle"],
}
FOLDERS = {name: ROOT / "ssp" / name for name in RECORDED}
every_system = pytest.mark.parametrize("name", RECORDED)
NAMESPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
}


@pytest.fixture(scope="module")
def archives(fmus, tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("systems")
    return {name: pack_ssp(source, fmus, folder / f"{name}.ssp", ["this"]) for name, source in FOLDERS.items()}


def test_every_system_is_here_and_in_the_table_of_the_page():
    """But those whose own README says that they show what other tools cannot do."""
    found = {path.parent.name for path in (ROOT / "ssp").glob("*/SystemStructure.ssd")}
    page = (ROOT / "docs" / "interoperability.md").read_text()
    told = dict(re.findall(r"^\| `ssp/(\w+)` \| (yes|no)\b", page, re.MULTILINE))
    assert told == {name: "yes" if name in RECORDED else "no" for name in found}


@every_system
def test_the_systems_are_right_and_in_the_portable_profile(archives, name):
    """Nothing that they use is ignored or refused by libcosim, ecos or OMSimulator; fmpy.ssp ignores their parameters."""
    assert check_ssp(archives[name]) == []
    files = read_archive(archives[name].read_bytes(), name)
    assert uses(files, LIBCOSIM, ECOS, OMSIMULATOR) == []
    assert {use.feature for use in uses(files, FMPY)} == {"parameters bound to a component"}
    root = etree.fromstring(files["SystemStructure.ssd"])
    assert {prefix: root.nsmap.get(prefix) for prefix in NAMESPACES} == NAMESPACES
    sets = [content for file, content in files.items() if file.startswith("resources/") and file.endswith(".ssv")]
    assert {etree.fromstring(content).get("name") for content in sets} == {"nominal"}
    description = load_ssp(archives[name]).structure
    assert None not in (description.start_time, description.stop_time, description.step_size)


@where_the_masters_run
@pytest.mark.parametrize("master", PACKAGES)
def test_other_masters_give_our_values(archives, master, tmp_path):
    """Over the default experiment, as our "parallel" algorithm on the grid: the same steps, the same delays."""
    require(master)
    jobs, ours = {}, {}
    for name, archive in archives.items():
        loaded = load_ssp(archive)
        stop, step = loaded.structure.stop_time, loaded.structure.step_size
        assert stop is not None
        assert step is not None
        record = [(instance, variable, "real") for instance, variable in (label.split(".") for label in RECORDED[name])]
        jobs[name] = Job(str(archive), step, round(stop / step), record)
        ours[name] = loaded.simulate(stop, step, algorithm="parallel", exact=False, record=RECORDED[name])
    for name, run in run_jobs(master, jobs, tmp_path).items():
        for label, found in zip(RECORDED[name], np.array(run.rows).T, strict=True):
            expected = ours[name][label][1:]
            assert np.abs(expected).max() > 0.0
            assert np.abs(found - expected).max() <= 1e-9 * np.abs(expected).max(), (name, label)


FMPY_RUN = """
import json, sys, fmpy.ssp.simulation
result = fmpy.ssp.simulation.simulate_ssp(sys.argv[1], stop_time=float(sys.argv[2]), step_size=float(sys.argv[3]))
print("RESULT" + json.dumps({name: [float(value) for value in result[name]] for name in result.dtype.names}))
"""


def test_fmpy_deviates_by_what_it_ignores_and_by_its_times(archives):
    """fmpy.ssp runs the beam without its parameters: its values are ours for the FMUs' start values, each told for the time
    one step before, as it pairs the start of a step with the values at its end; and with the inputs of the end of that step,
    which is our "jacobi" algorithm. With the archive's parameters they are other values altogether.
    """
    archive = archives["s_curve_beam"]
    loaded = load_ssp(archive)
    stop, step = loaded.structure.stop_time, loaded.structure.step_size
    assert stop is not None
    assert step is not None
    command = [sys.executable, "-c", FMPY_RUN, str(archive), repr(stop), repr(step)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("RESULT")).removeprefix("RESULT"))
    files, labels = read_archive(archive.read_bytes(), "x"), ["beam.base_acceleration", "beam.tip_deflection"]
    bare = System()
    for name, fmu in (("profile", "MotionProfile_s_curve"), ("beam", "FlexibleBeam")):
        bare.add(name, fmu_from_bytes(f"{fmu}.fmu", files[f"resources/{fmu}.fmu"]))
    bare.connect("profile.acceleration", "beam.base_acceleration")
    record = ["profile.acceleration", "beam.tip_deflection"]
    ours = bare.simulate(stop, step, algorithm="jacobi", exact=False, record=record)
    bound = loaded.simulate(stop, step, algorithm="jacobi", exact=False, record=record)
    assert np.allclose(found["time"], ours.time[:-1], rtol=0.0, atol=1e-9)
    for label, column in zip(labels, record, strict=True):
        values, expected = np.array(found[label]), ours[column]
        scale = np.abs(expected).max()
        assert np.abs(values - expected[1:]).max() <= 1e-9 * scale  # told for the time before
        assert np.abs(values - expected[:-1]).max() > 1e-2 * scale
        assert np.abs(values - bound[column][1:]).max() > 0.5 * np.abs(bound[column]).max()  # without the parameters

"""The systems of ssp/ in other people's masters: libcosim and ecos. Both read no ssv:Enumeration; nothing else may stop them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from other_masters import Job, run_jobs
from test_native_interoperability import PACKAGES, require
from test_native_interoperability import pytestmark as where_the_masters_run

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.ssp.archive import load_ssp, pack_ssp

ROOT = Path(__file__).parents[1]
RECORDED = {
    "overhead_crane": ["shaper.shaped_mean", "crane.trolley_position", "crane.swing_angle", "crane.load_position"],
    "partial_modes_three_mass": ["chain.position[1]", "chain.position[3]", "chain.velocity[1]"],
    "pwm_mass_spring": ["train.pulse", "plant.position", "plant.velocity"],
    "s_curve_beam": ["profile.acceleration", "beam.base_position", "beam.tip_deflection"],
    "two_part_pendulum": ["profile.position", "arm.slide_position", "arm.swing_angle"],
}
FOLDERS = {path.parent.name: path.parent for path in sorted((ROOT / "ssp").glob("*/SystemStructure.ssd"))}
SETS = {name: sorted((folder / "resources").glob("*.ssv")) for name, folder in FOLDERS.items()}
PORTABLE = [name for name, sets in SETS.items() if not any("ssv:Enumeration" in path.read_text() for path in sets)]
NAMESPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
}


def test_the_page_tells_which_systems_run_as_they_are():
    page = (ROOT / "docs" / "interoperability.md").read_text()
    told = dict(re.findall(r"^\| `ssp/(\w+)` \| (yes|no)\b", page, re.MULTILINE))
    assert told == {name: "yes" if name in PORTABLE else "no" for name in FOLDERS}
    assert PORTABLE
    assert set(RECORDED) == set(FOLDERS)


@pytest.mark.parametrize("name", FOLDERS)
def test_the_files_are_as_both_masters_want_them(name):
    """libcosim finds osp: on the root element alone, and ecos applies parameter sets of the asked name alone."""
    root = etree.parse(FOLDERS[name] / "SystemStructure.ssd").getroot()
    assert {prefix: root.nsmap.get(prefix) for prefix in NAMESPACES} == NAMESPACES
    assert {etree.parse(path).getroot().get("name") for path in SETS[name]} == {"nominal"}


@pytest.fixture(scope="module")
def archives(fmus, tmp_path_factory) -> dict[str, Path]:
    """Those that run as they are; the others without the lines that name enumerations, which then have their start values."""
    folder, written = tmp_path_factory.mktemp("systems"), {}
    for name, source in FOLDERS.items():
        written[name] = pack_ssp(source, fmus, folder / f"{name}.ssp")
        if name not in PORTABLE:
            files = read_archive(written[name].read_bytes(), f"{name}.ssp")
            sets = {file: content for file, content in files.items() if file.startswith("resources/") and file.endswith(".ssv")}
            bare = {file: re.sub(rb".*<ssv:Enumeration .*\n", b"", content) for file, content in sets.items()}
            assert bare != sets
            write_archive(written[name], {**files, **bare})
    return written


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
        ours[name] = loaded.system.simulate(stop, step, algorithm="parallel", exact=False, record=RECORDED[name])
    for name, run in run_jobs(master, jobs, tmp_path).items():
        for label, found in zip(RECORDED[name], np.array(run.rows).T, strict=True):
            expected = ours[name][label][1:]
            assert np.abs(expected).max() > 0.0
            assert np.abs(found - expected).max() <= 1e-9 * np.abs(expected).max(), (name, label)

"""FMUs that may be instantiated only once per process: one instance at a time, never what another one has left, and said by the flag."""

from __future__ import annotations

import gc
import shutil
import sys
import zipfile
from pathlib import Path

import pytest
from faulty_fmus import alone, description3, faulty_fmu, library, library_path
from global_fmus import build_global
from sweep_cases import runs_of

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.once import FLAG, OccupiedError, once_key
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.ssp.check import check_ssp
from shaper_fmu.sweep.engine import engine_for, run_study
from shaper_fmu.sweep.study import read_study

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the FMU is written for POSIX")


@pytest.fixture
def path(tmp_path) -> Path:
    """The FMU, a new one in each test."""
    return build_global(tmp_path)


def system_of(path: Path, **values: float) -> System:
    system = System()
    system.add("x", path, **{"rate": 1.0, **values})
    return system


def test_two_instances_in_one_system_are_refused_by_the_flag(path, tmp_path):
    """Each of them would give 3 and not 1 and 2: their sums are one."""
    copy = shutil.copy(path, tmp_path / "other.fmu")
    system = System()
    system.add("a", path, rate=1.0)
    system.add("part.b", load_fmu(copy), rate=2.0)
    (problem,) = system.check()
    assert problem.startswith(f"a and part.b are instances of the same FMU (global.fmu), which says {FLAG}: in one process")
    for isolate in (False, True):
        with pytest.raises(ModelError, match=FLAG):
            system.simulate(1.0, 0.1, isolate=isolate)


def archive_of(path: Path, *names: str) -> Path:
    """An SSP archive with these instances, beside the FMU."""
    components = "".join(f'<ssd:Component name="{name}" source="resources/global.fmu"/>' for name in names)
    with zipfile.ZipFile(path.with_suffix(".ssp"), "w") as archive:
        archive.writestr(
            "SystemStructure.ssd",
            '<ssd:SystemStructureDescription version="1.0" name="global" '
            'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"><ssd:System name="root"><ssd:Elements>'
            f"{components}</ssd:Elements></ssd:System></ssd:SystemStructureDescription>",
        )
        archive.write(path, "resources/global.fmu")
    return path.with_suffix(".ssp")


def test_check_tells(path):
    told = f"a, b and c are instances of the same FMU (global.fmu), which says {FLAG}"
    assert any(told in problem for problem in check_ssp(archive_of(path, "a", "b", "c")))
    assert not any(FLAG in problem for problem in check_ssp(archive_of(path, "a")))


def test_two_simulations_at_once_are_refused_and_one_after_the_other_is_right(path, tmp_path):
    copy = shutil.copy(path, tmp_path / "other.fmu")
    with Simulation(system_of(path)) as simulation:
        assert simulation.run(1.0, 0.1)["x.sum"][-1] == pytest.approx(1.0, abs=1e-12)
        for other in (path, copy):
            with pytest.raises(OccupiedError, match=rf"^x: \w+.fmu says {FLAG}, and this process has its instance x, of a"):
                Simulation(system_of(other))
        assert system_of(path, rate=3.0).simulate(1.0, 0.1, isolate=True)["x.sum"][-1] == pytest.approx(3.0, abs=1e-12)
        assert simulation.run(1.0, 0.1)["x.sum"][-1] == pytest.approx(1.0, abs=1e-12)
    assert system_of(copy, rate=2.0).simulate(1.0, 0.1)["x.sum"][-1] == pytest.approx(2.0, abs=1e-12)  # not 3


def test_a_simulation_that_was_forgotten_still_counts(path):
    Simulation(system_of(path))
    gc.collect()
    with pytest.raises(OccupiedError, match=r"Close simulations as soon as they are done \(close\(\)"):
        Simulation(system_of(path))


def test_a_library_that_stays_loaded_is_not_used_again(tmp_path):
    """The second run would begin with the sum 1 of the first."""
    path = build_global(tmp_path, "stays", stays=True)
    assert system_of(path).simulate(1.0, 0.1)["x.sum"][-1] == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(OccupiedError, match=r"its library, which stays loaded after its instance x was freed"):
        system_of(path).simulate(1.0, 0.1)
    assert system_of(path).simulate(1.0, 0.1, isolate=True)["x.sum"][-1] == pytest.approx(1.0, abs=1e-12)


def test_an_instance_that_cannot_be_freed_still_counts(path):
    with pytest.raises(SimulationError, match="Fatal"):
        system_of(path, fatal=1).simulate(1.0, 0.1)
    with pytest.raises(OccupiedError, match="its instance x, which failed beyond repair and cannot be freed"):
        system_of(path).simulate(1.0, 0.1)


def test_instances_that_were_never_made_do_not_count(tmp_path):
    flagged = description3("{faulty}").replace("hasEventMode", f'{FLAG}="true" hasEventMode')
    with zipfile.ZipFile(tmp_path / "flagged.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", flagged)
        archive.write(library("faulty3"), library_path(3))
    fmu = load_fmu(tmp_path / "flagged.fmu")
    assert once_key(fmu) == ("{faulty}", "faulty")
    assert once_key(load_fmu(faulty_fmu(3))) is None

    def named(name: str) -> System:
        system = alone(3, name=name)
        system.fmus[name] = fmu
        return system

    with pytest.raises(SimulationError, match="there is no instance today"):
        Simulation(named("null"))  # this FMU returns NULL for this name
    with Simulation(named("x")) as simulation:
        assert simulation.instances["x"].event_mode
        with pytest.raises(OccupiedError, match=FLAG):
            Simulation(named("y"))
    simulation = Simulation(named("x"))
    simulation.run(1.0, 0.1)
    simulation.run(1.0, 0.1, exact=False)  # without event mode: another instance, after the first is freed
    simulation.close()


STUDY = """
name = "global"
system = "global.ssp"
stop_time = 1.0
step = 0.1
[plan]
kind = "zip"
[vary."x.rate"]
values = [1.0, 2.0, 3.0, 4.0, 5.0]
[vary."x.fatal"]
values = [0, 0, 1, 0, 0]
[compare]
all = { "x.forgetful" = 1 }
[metrics.final]
kind = "final"
output = "x.sum"
"""


@pytest.mark.representatives(stays=[True])
@pytest.mark.parametrize("stays", [False, True])
def test_sweeps_go_on_in_new_processes(tmp_path, stays):
    """After instances that could not be freed, and where a reset leaves something behind and the library stays loaded, too."""
    archive_of(build_global(tmp_path, stays=stays), "x")
    (tmp_path / "study.toml").write_text(STUDY)
    study, store = read_study(tmp_path / "study.toml"), tmp_path / "store.sqlite"
    assert run_study(study, store, engine=engine_for(1)) == {"done": 4, "failed": 1}
    runs = runs_of(store)
    assert [run.metrics.get("final", 0.0) for run in runs] == pytest.approx([1.0, 2.0, 0.0, 4.0, 5.0], abs=1e-12)
    assert "Fatal" in (runs[2].reason or "")
    with pytest.raises(OccupiedError, match="separate process"):  # serial sweeps have one process alone
        run_study(study, tmp_path / "serial.sqlite", engine=engine_for(0))

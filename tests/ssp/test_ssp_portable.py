"""What `check --portable` tells of other tools: each feature in an archive of its own, found by us and tried in the tools themselves.

All of them run in processes of their own.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from other_masters import Job, run_jobs
from portable_cases import CASES, PLAIN, SSD, archive
from test_native_interoperability import pytestmark as where_the_masters_run
from test_native_interoperability import require

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.export.build import build_fmu, fmu_path
from shaper_fmu.registry import load_components
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.portable import ECOS, EFFECTS, ENDS, FMPY, LIBCOSIM, REFUSE, uses

STEP, STEPS = 0.01, 200
AS_OURS = {"runs only SystemStructure.ssd"}  # which is what is compared
UNSURE = {"has crashed on it"}  # but not each time
FMPY_RUN = """
import json, sys, fmpy.ssp.simulation
found = {}
for name, path, label in json.loads(sys.argv[1]):
    try:
        result = fmpy.ssp.simulation.simulate_ssp(path, stop_time=2.0, step_size=0.01)
        found[name] = [float(value) for value in result[label]]
    except Exception as error:
        found[name] = None
print("RESULT" + json.dumps(found))
"""


def fmpy_runs(asked: list[tuple[str, str, str]]) -> dict[str, list[float] | None]:
    """Columns of fmpy.ssp's results, asked for by a name, the archive's path and the variable; None where it fails."""
    done = subprocess.run([sys.executable, "-c", FMPY_RUN, json.dumps(asked)], capture_output=True, text=True, check=True)
    return json.loads(next(line for line in done.stdout.splitlines() if line.startswith("RESULT")).removeprefix("RESULT"))


@pytest.fixture(scope="module")
def archives(fmus, tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("portable")
    return {name: archive(case, fmus, folder / f"{name.replace(' ', '_')}.ssp") for name, case in CASES.items()}


@pytest.fixture(scope="module")
def ours(archives) -> dict[str, np.ndarray]:
    """The plant's position after each step, by the algorithm of libcosim and ecos."""
    found = {}
    for name, path in archives.items():
        loaded = load_ssp(path)
        label = next(f"{instance}.position" for instance in loaded.system.fmus if instance.endswith("plant"))
        found[name] = loaded.simulate(STEPS * STEP, STEP, algorithm="parallel", exact=False, record=[label])[label][1:]
    return found


@pytest.mark.parametrize("name", CASES)
def test_features_are_found(archives, name):
    found = uses(read_archive(archives[name].read_bytes(), name))
    assert sorted(use.feature for use in found) == sorted(CASES[name].features)


def effect(name: str, tool: str) -> str:
    """What the features of a case do to a tool: the gravest counts; "" if the tool does as we do."""
    effects = [EFFECTS[feature].get(tool, "") for feature in CASES[name].features]
    grave = [found for found in effects if found in (REFUSE, ENDS, *UNSURE)]
    return (grave or [found for found in effects if found and found not in AS_OURS] or [""])[0]


def job(archives: dict[str, Path], name: str) -> Job:
    return Job(str(archives[name]), STEP, STEPS, [(CASES[name].instance, "position", "real")])


@where_the_masters_run
@pytest.mark.parametrize("tool", [LIBCOSIM, ECOS])
def test_libcosim_and_ecos_do_what_is_told(archives, ours, tool, tmp_path):
    require(tool)
    running = [name for name in CASES if effect(name, tool) not in (REFUSE, ENDS, *UNSURE)]
    for name, run in run_jobs(tool, {name: job(archives, name) for name in running}, tmp_path).items():
        difference = np.abs(np.array(run.rows)[:, 0] - ours[name]).max() / np.abs(ours["nothing"]).max()
        if effect(name, tool):
            assert difference > 1e-3, (name, effect(name, tool))
        else:
            assert difference <= 1e-9, name
    for name in (name for name in CASES if effect(name, tool) in (REFUSE, ENDS)):
        with pytest.raises(AssertionError, match="status -" if effect(name, tool) == ENDS else "status 1"):
            run_jobs(tool, {name: job(archives, name)}, tmp_path)


@pytest.fixture(scope="module")
def fmpy_results(archives) -> dict[str, list[float] | None]:
    return fmpy_runs([(name, str(path), f"{CASES[name].instance}.position") for name, path in archives.items()])


@pytest.mark.parametrize("name", CASES)
def test_fmpy_does_what_is_told(fmpy_results, ours, name):
    """The same in the end; on the way it is another algorithm, and its values belong to the step before."""
    found, told = fmpy_results[name], effect(name, FMPY)
    if told == REFUSE:
        assert found is None
        return
    assert found is not None
    if told and name not in ("item", "number of an item", "sets of two names"):  # whose effect is no more at the end
        assert abs(found[-1] - ours[name][-1]) > 1e-3 * abs(ours["nothing"][-1])
    elif not told:
        assert found[-1] == pytest.approx(ours[name][-1], rel=1e-2)


BENCH = '''\
"""What shows a length in millimetres and a switch."""

from shaper_fmu.component import Component, Input, Output


class Bench(Component):
    """Shows what comes in."""

    length = Input("mm", "a length")
    switch = Input("", "a switch", False, kind=bool)
    seen = Output("mm", "the length")
    on = Output("", "the switch", False, kind=bool)

    def step(self, t, h):
        self.seen = self.length
        self.on = self.switch
'''
NEGATED = """<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>
<ssc:MapEntry source="false" target="true"/></ssc:BooleanMappingTransformation></ssd:Connection>"""


@pytest.fixture(scope="module")
def bench(fmus, tmp_path_factory) -> Path:
    """A move of 1 m in 1 s, seen in millimetres by its length, and seen negated by whether it is under way."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "bench.py").write_text(BENCH)
    built = build_fmu(load_components(folder / "bench.py")[0], folder, platforms=["this"])
    begin, end = PLAIN.index('<ssd:Component name="shaper"'), PLAIN.index("</ssd:Elements>")
    connectors = "".join(
        f'<ssd:Connector name="{name}" kind="{kind}"><ssc:{type_}/></ssd:Connector>'
        for name, kind, type_ in (
            ("length", "input", 'Real unit="mm"'),
            ("switch", "input", "Boolean"),
            ("seen", "output", 'Real unit="mm"'),
            ("on", "output", "Boolean"),
        )
    )
    component = (
        f'<ssd:Component name="bench" source="resources/Bench.fmu"><ssd:Connectors>{connectors}</ssd:Connectors></ssd:Component>'
    )
    text = PLAIN[:begin] + component + PLAIN[end:]
    begin, end = text.index("<ssd:Connections>"), text.index("</ssd:Connections>")
    one = '<ssd:Connection startElement="profile" startConnector="{}" endElement="bench" endConnector="{}"'
    text = (
        f"{text[:begin]}<ssd:Connections>{one.format('position', 'length')}/>{one.format('moving', 'switch')}>{NEGATED}{text[end:]}"
    )
    moving = '<ssd:Connector name="moving" kind="output"><ssc:Boolean/></ssd:Connector><ssd:Connector name="position"'
    text = text.replace('<ssd:Connector name="position"', moving, 1)
    files = {"resources/Bench.fmu": built.read_bytes(), "resources/MotionProfile.fmu": (fmus / "MotionProfile.fmu").read_bytes()}
    return write_archive(folder / "bench.ssp", {SSD: text.encode(), **files})


@where_the_masters_run
def test_units_are_not_converted_and_mappings_not_applied_by_others(bench, tmp_path):
    """They pass 1 (m) on as 1 (mm), and false, no longer under way, as false."""
    found = {use.feature for use in uses(read_archive(bench.read_bytes(), "bench"))}
    assert found == {"units to convert", "a mapping of values"}
    results = load_ssp(bench).simulate(STEPS * STEP, STEP, algorithm="parallel", exact=False, record=["bench.seen", "bench.on"])
    assert [results["bench.seen"][-1], results["bench.on"][-1]] == [1000.0, 1.0]
    asked = Job(str(bench), STEP, STEPS, [("bench", "seen", "real"), ("bench", "on", "boolean")])
    for tool in (LIBCOSIM, ECOS):
        require(tool)
        seen, on = run_jobs(tool, {"bench": asked}, tmp_path)["bench"].rows[-1]
        assert (seen, bool(on)) == (1.0, False)
        assert tool in EFFECTS["units to convert"].keys() & EFFECTS["a mapping of values"].keys()
    theirs = fmpy_runs([("seen", str(bench), "bench.seen"), ("on", str(bench), "bench.on")])
    assert [(theirs[name] or [-1.0])[-1] for name in ("seen", "on")] == [1.0, 0.0]


@where_the_masters_run
def test_libcosim_refuses_fmi_3_and_ecos_runs_it(archives, ours, tmp_path):
    files = read_archive(archives["nothing"].read_bytes(), "x")
    files["resources/MassSpringDamper.fmu"] = fmu_path("MassSpringDamper", fmi=3, platforms=["this"]).read_bytes()
    path = write_archive(tmp_path / "three.ssp", files)
    assert [use.feature for use in uses(files)] == ["an FMU of FMI 3.0"]
    asked = {"three": Job(str(path), STEP, STEPS, [("plant", "position", "real")])}
    with pytest.raises(AssertionError, match="status 1"):
        run_jobs(LIBCOSIM, asked, tmp_path)
    run = run_jobs(ECOS, asked, tmp_path)["three"]
    assert np.abs(np.array(run.rows)[:, 0] - ours["nothing"]).max() <= 1e-9 * np.abs(ours["nothing"]).max()


def test_every_effect_of_the_three_tools_is_tried():
    """Those of the features that need other FMUs are tried above, but for arrays, which docs/interoperability.md tells of."""
    tried = {(feature, tool) for case in CASES.values() for feature in case.features for tool in EFFECTS[feature]}
    told = {
        (feature, tool) for feature, effects in EFFECTS.items() for tool, effect in effects.items() if "its issue" not in effect
    }
    others = {"a mapping of values", "units to convert", "an FMU of FMI 3.0", "an FMU of FMI 3.0 with arrays"}
    assert {feature for feature, _ in told - tried} == others

"""How wrong may the stiffness be? ZV and ZVD swept over it, and their insensitivity read off and compared with the formula.

The system is an SSP archive of two FMUs, written here; the sweep is resumable: run it again, and nothing is left to do.
Leaves results/04_robustness_sweep.png.
"""

import math
from pathlib import Path

import numpy as np

from shaper_fmu import Store, build_fmu, find_component, insensitivity, run_study, shaper
from shaper_fmu.metrics.residual import Residual
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.page.pictures import write_picture
from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.sweep.refine import slices, tolerated_band
from shaper_fmu.sweep.study import Refine, Study
from shaper_fmu.sweep.variation import Vary

NATURAL_FREQUENCY, TOLERANCE = 10.0, 0.05  # rad/s, share of the unshaped vibration
STIFFNESS = NATURAL_FREQUENCY**2  # N/m, of a mass of 1 kg

SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="shaped_step">
  <ssd:System name="root">
    <ssd:Elements>
      <ssd:Component name="shaper" type="application/x-fmu-sharedlibrary" source="resources/InputShaper.fmu">
        <ssd:Connectors><ssd:Connector name="shaped" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors>
        <ssd:ParameterBindings><ssd:ParameterBinding source="resources/shaper.ssv"/></ssd:ParameterBindings>
      </ssd:Component>
      <ssd:Component name="plant" type="application/x-fmu-sharedlibrary" source="resources/MassSpringDamper.fmu">
        <ssd:Connectors><ssd:Connector name="force" kind="input"><ssc:Real/></ssd:Connector></ssd:Connectors>
        <ssd:ParameterBindings><ssd:ParameterBinding source="resources/plant.ssv"/></ssd:ParameterBindings>
      </ssd:Component>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startElement="shaper" startConnector="shaped" endElement="plant" endConnector="force"/>
    </ssd:Connections>
  </ssd:System>
</ssd:SystemStructureDescription>
"""
VALUES = {
    "shaper": {"command": 1.0, "natural_frequency[1]": NATURAL_FREQUENCY, "damping_ratio[1]": 0.0},
    "plant": {"mass": 1.0, "stiffness": STIFFNESS, "damping": 0.0},
}


def write_system(folder: Path) -> Path:
    """The archive of the system, with the FMUs that it names."""
    (folder / "resources").mkdir(parents=True, exist_ok=True)
    (folder / "SystemStructure.ssd").write_text(SYSTEM)
    for name, values in VALUES.items():
        rows = "".join(f'<ssv:Parameter name="{key}"><ssv:Real value="{value}"/></ssv:Parameter>' for key, value in values.items())
        (folder / "resources" / f"{name}.ssv").write_text(
            '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" '
            f'name="nominal"><ssv:Parameters>{rows}</ssv:Parameters></ssv:ParameterSet>'
        )
    return pack_ssp(folder, "fmus")


for name in ("InputShaper", "MassSpringDamper"):
    build_fmu(find_component(name), "fmus", platforms=["this"])
archive = write_system(Path("results/shaped_step"))

study = Study(
    name="Wrong stiffness",
    system=str(archive),
    stop_time=2.0,  # ZVD takes 0.63 s, the slowest vibration has a period of 1.05 s
    step=0.001,
    vary={"plant.stiffness": Vary(nominal=STIFFNESS, low=0.36 * STIFFNESS, high=1.96 * STIFFNESS, points=61)},
    compare={kind: {"shaper.shaper": kind} for kind in ("none", "zv", "zvd")},
    reference="none",
    metrics={"residual": Residual(output="plant.position", command="shaper.shaped")},
    refine=Refine(metric="residual", level=TOLERANCE, width=0.01),  # N/m: where the residual crosses 5 %, runs in between
)
store = Path("results/04_robustness_sweep.sqlite")
counts = run_study(study, store)  # in this process; with engine=engine_for(workers=2) in two others
print(f"{counts['done']} runs done, in {store}")

lines = []
with Store(store) as opened:
    for kind, _, curve in slices(study, opened, 0):  # stiffness and residual, as a share of the unshaped one
        if kind == "none":
            continue
        band = tolerated_band(curve, TOLERANCE, STIFFNESS)
        assert band is not None
        low, high = (math.sqrt(stiffness / STIFFNESS) for stiffness in band)
        formula = insensitivity(shaper(kind, NATURAL_FREQUENCY, 0.0), NATURAL_FREQUENCY, tolerance=TOLERANCE)
        print(f"{kind:3}  insensitivity {high - low:.5f} by {len(curve)} runs, {formula:.5f} by the formula")
        stiffness, residual = np.array(curve).T
        lines.append(Line(kind.upper(), np.sqrt(stiffness / STIFFNESS), 100.0 * residual))

levels = [(100.0 * TOLERANCE, "5 %")]
labels = "actual over designed frequency", "residual vibration [% of the unshaped]"
figure = Figure("sweep", "A step on a mass whose spring is not as stiff as thought", *labels, lines, levels)
print(write_picture(figure, Path("results/04_robustness_sweep.png")))

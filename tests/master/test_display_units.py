"""In which unit values are shown: that of the display unit where a factor does, else their own; FMI 2.0.5 and 3.0.2, 2.2.2."""

from __future__ import annotations

import math

import pytest
from bare_fmus import bare_fmu

from shaper_fmu.master.structure import SystemStructure

UNITS = """<Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.29577951308232"/></Unit>
<Unit name="K"><BaseUnit K="1"/><DisplayUnit name="degC" offset="-273.15"/><DisplayUnit name="mK" factor="1000"/></Unit>
<Unit name="Hz"><BaseUnit s="-1"/><DisplayUnit name="s" inverse="true"/><DisplayUnit name="kHz" factor="0.001"/></Unit>
<Unit name="m"><BaseUnit m="1"/><DisplayUnit name="nothing" factor="0"/></Unit>"""
TYPES = '<Float64Type name="Angle" unit="rad" displayUnit="deg"/>'
VARIABLES = [
    ('name="own" unit="rad" displayUnit="deg"', ("deg", 180.0 / math.pi)),
    ('name="typed" declaredType="Angle"', ("deg", 180.0 / math.pi)),
    ('name="without" unit="rad"', ("rad", 1.0)),
    ('name="warm" unit="K" displayUnit="degC"', ("K", 1.0)),  # 293.15 K are not 293.15 degC
    ('name="cold" unit="K" displayUnit="mK"', ("mK", 1000.0)),
    ('name="period" unit="Hz" displayUnit="s"', ("Hz", 1.0)),  # 4 Hz are not 4 s
    ('name="frequency" unit="Hz" displayUnit="kHz"', ("kHz", 0.001)),
    ('name="place" unit="m" displayUnit="nothing"', ("m", 1.0)),
]


def test_only_a_display_unit_that_is_a_factor_is_shown(tmp_path):
    told = "\n".join(
        f'<Float64 valueReference="{n}" causality="output" {attributes}/>' for n, (attributes, _) in enumerate(VARIABLES, 1)
    )
    outputs = "".join(f'<Output valueReference="{n}"/>' for n in range(1, len(VARIABLES) + 1))
    text = (
        '<fmiModelDescription fmiVersion="3.0" modelName="shown" instantiationToken="3"><CoSimulation modelIdentifier="shown"/>'
        f"<UnitDefinitions>{UNITS}</UnitDefinitions><TypeDefinitions>{TYPES}</TypeDefinitions>"
        f"<ModelVariables>{told}</ModelVariables><ModelStructure>{outputs}</ModelStructure></fmiModelDescription>"
    )
    system = SystemStructure()
    system.add("plant", bare_fmu(tmp_path / "shown.fmu", text))
    for attributes, (unit, factor) in VARIABLES:
        name = attributes.split('"')[1]
        found = system.display_unit(("plant", name))
        assert found == (unit, pytest.approx(factor, rel=1e-15)), name

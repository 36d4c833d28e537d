"""FMUs of FMI 2.0 and 3.0 that are descriptions alone, with all that a description can say of variables (not run)."""

from __future__ import annotations

from pathlib import Path

from bare_fmus import bare_fmu

TWO = """<fmiModelDescription fmiVersion="2.0" modelName="rich" guid="{2}" description="all of FMI 2.0"
 variableNamingConvention="structured"><CoSimulation modelIdentifier="rich" canGetAndSetFMUstate="true"/>
<UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.29577951308232"/></Unit>
<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit><Unit name="K"><BaseUnit K="1"/></Unit></UnitDefinitions>
<TypeDefinitions>
<SimpleType name="Angle" description="an angle"><Real quantity="Angle" unit="rad" displayUnit="deg" min="-4" max="4" nominal="2"/></SimpleType>
<SimpleType name="Gear"><Enumeration quantity="Gear"><Item name="low" value="1" description="slow"/><Item name="high" value="3"/></Enumeration></SimpleType>
<SimpleType name="Count"><Integer min="0" max="9" quantity="Number"/></SimpleType>
</TypeDefinitions>
<ModelVariables>
<ScalarVariable name="angle" valueReference="0" causality="input" description="of the crank"><Real declaredType="Angle" start="0.25"/></ScalarVariable>
<ScalarVariable name="gear" valueReference="1" causality="input" variability="discrete"><Enumeration declaredType="Gear" start="3"/></ScalarVariable>
<ScalarVariable name="on" valueReference="2" causality="input" variability="discrete"><Boolean start="true"/></ScalarVariable>
<ScalarVariable name="label" valueReference="3" causality="input" variability="discrete"><String start="as &lt;is&gt;"/></ScalarVariable>
<ScalarVariable name="count" valueReference="4" causality="output" variability="discrete" initial="calculated"><Integer declaredType="Count"/></ScalarVariable>
<ScalarVariable name="warm" valueReference="5" causality="output"><Real unit="K" relativeQuantity="true" unbounded="true"/></ScalarVariable>
<ScalarVariable name="x" valueReference="6" causality="output" initial="exact"><Real start="1.5" unit="rad" displayUnit="deg" nominal="0.1"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="7" causality="local"><Real derivative="7"/></ScalarVariable>
<ScalarVariable name="pi" valueReference="8" causality="output" variability="constant" initial="exact"><Real start="3.14159"/></ScalarVariable>
<ScalarVariable name="mass" valueReference="9" causality="parameter" variability="fixed"><Real start="2" min="0"/></ScalarVariable>
<ScalarVariable name="gain" valueReference="10" causality="parameter" variability="tunable"><Real start="INF"/></ScalarVariable>
<ScalarVariable name="double" valueReference="11" causality="calculatedParameter" variability="fixed"><Real/></ScalarVariable>
<ScalarVariable name="guess" valueReference="12" causality="local" variability="fixed" initial="approx"><Real start="0.5"/></ScalarVariable>
<ScalarVariable name="time" valueReference="13" causality="independent"><Real/></ScalarVariable>
<ScalarVariable name="crank.speed" valueReference="14"><Real/></ScalarVariable>
</ModelVariables><ModelStructure>
<Outputs><Unknown index="5" dependencies="2" dependenciesKind="dependent"/><Unknown index="6" dependencies="1" dependenciesKind="constant"/>
<Unknown index="7" dependencies=""/><Unknown index="9" dependencies=""/></Outputs>
<Derivatives><Unknown index="8"/></Derivatives>
<InitialUnknowns><Unknown index="5"/><Unknown index="6"/><Unknown index="8"/><Unknown index="12" dependencies="10"/></InitialUnknowns>
</ModelStructure></fmiModelDescription>"""

_TIME = '<Float64 name="time" valueReference="99" causality="independent" variability="continuous"/>'
THREE = (
    """<fmiModelDescription fmiVersion="3.0" modelName="rich" instantiationToken="3"><CoSimulation modelIdentifier="rich"/>
<UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="rev" factor="0.15915494309189535"/></Unit>
<Unit name="K"><BaseUnit K="1" factor="2"/></Unit></UnitDefinitions>
<TypeDefinitions>
<Float64Type name="Angle" unit="rad" displayUnit="rev" min="-1"/><Int64Type name="Long" quantity="Number" min="-9000000000"/>
<EnumerationType name="Gear"><Item name="low" value="1"/><Item name="high" value="2"/></EnumerationType></TypeDefinitions>
<ModelVariables>
"""
    + _TIME
    + """
<UInt64 name="n" valueReference="1" causality="structuralParameter" variability="fixed" start="2"/>
<Float64 name="u" valueReference="2" causality="input" start="1 2" declaredType="Angle" description="both"><Dimension valueReference="1"/><Alias name="also_u" description="u again"/></Float64>
<Float32 name="single" valueReference="3" causality="input" start="0.5"/>
<UInt8 name="small" valueReference="4" causality="input" start="7" min="1" max="200"/>
<Int64 name="long" valueReference="5" causality="output" declaredType="Long"/>
<Boolean name="flags" valueReference="6" causality="input" start="true false"><Dimension start="2"/></Boolean>
<String name="labels" valueReference="7" causality="parameter" variability="fixed"><Dimension start="2"/><Start value="one two"/><Start value="three"/></String>
<Binary name="blob" valueReference="8" causality="input" mimeType="image/x" maxSize="9"><Start value="0aff"/></Binary>
<Clock name="tick" valueReference="9" causality="input" intervalVariability="constant" intervalDecimal="0.1"/>
<Enumeration name="gear" valueReference="10" causality="output" declaredType="Gear"/>
<Float64 name="m" valueReference="11" causality="parameter" variability="tunable" start="1 2 3 4 5 6" unit="K"><Dimension start="2"/><Dimension start="3"/></Float64>
<Float64 name="y" valueReference="12" causality="output" initial="calculated" unit="rad"><Dimension valueReference="1"/><Alias name="also_y" displayUnit="rev"/></Float64>
<Int64 name="huge" valueReference="13" causality="parameter" variability="fixed" start="9000000000"/>
<Float64 name="none" valueReference="14" causality="input" min="2"/>
</ModelVariables><ModelStructure><Output valueReference="5"/><Output valueReference="10" dependencies="4"/>
<Output valueReference="12" dependencies="2" dependenciesKind="constant"/>
<InitialUnknown valueReference="5"/><InitialUnknown valueReference="10"/><InitialUnknown valueReference="12"/></ModelStructure></fmiModelDescription>"""
)


def rich_fmu(folder: Path, version: int) -> Path:
    """The FMU, without a library."""
    return bare_fmu(folder / f"rich{version}.fmu", TWO if version == 2 else THREE)

"""FMUs that are descriptions alone, for what is read and not run: of each version and kind, large ones, and hostile names."""

from __future__ import annotations

from pathlib import Path

from shaper_fmu.archives import write_archive

ONE = """<fmiModelDescription fmiVersion="1.0" modelName="tank" modelIdentifier="tank" guid="{1}" description="two tanks"
 generationTool="Old Tool 7.1" numberOfContinuousStates="2" numberOfEventIndicators="3">
<UnitDefinitions><BaseUnit unit="m3/s"/></UnitDefinitions>
<TypeDefinitions><Type name="Flow"><RealType unit="m3/s"/></Type>
<Type name="Valve"><EnumerationType><Item name="open"/><Item name="shut"/></EnumerationType></Type></TypeDefinitions>
<ModelVariables>
<ScalarVariable name="flow" valueReference="0" causality="input"><Real declaredType="Flow" start="0.25"/></ScalarVariable>
<ScalarVariable name="level" valueReference="1" causality="output"><Real unit="m"/></ScalarVariable>
<ScalarVariable name="area" valueReference="2" variability="parameter"><Real unit="m2" start="2" min="0"/></ScalarVariable>
<ScalarVariable name="valve" valueReference="3" variability="parameter"><Enumeration declaredType="Valve" start="2"/></ScalarVariable>
<ScalarVariable name="inner" valueReference="4" causality="internal"><Real/></ScalarVariable>
</ModelVariables>{more}</fmiModelDescription>"""
STANDALONE = """<Implementation><CoSimulation_StandAlone><Capabilities canHandleVariableCommunicationStepSize="true"
 canHandleEvents="false" maxOutputDerivativeOrder="1"/></CoSimulation_StandAlone></Implementation>"""
TWO = """<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{{2}}" generationTool="{tool}"
 numberOfEventIndicators="1">{kinds}<ModelVariables>{variables}</ModelVariables><ModelStructure>{structure}</ModelStructure>
</fmiModelDescription>"""
THREE = """<fmiModelDescription fmiVersion="3.0" modelName="rows" instantiationToken="3">{kinds}<ModelVariables>
<Float64 name="time" valueReference="9" causality="independent" variability="continuous"/>
<UInt64 name="n" valueReference="1" causality="structuralParameter" variability="tunable" start="3"/>
<Float64 name="gains" valueReference="2" causality="parameter" variability="tunable" start="1 2 3"><Dimension valueReference="1"/></Float64>
<Float64 name="x" valueReference="3" causality="output" initial="exact" start="0 0 0 0 0 0"><Dimension valueReference="1"/><Dimension start="2"/></Float64>
<Float64 name="v" valueReference="4" causality="local" derivative="3"><Dimension valueReference="1"/><Dimension start="2"/></Float64>
<Float64 name="z" valueReference="5" causality="local"><Dimension valueReference="1"/></Float64>
</ModelVariables><ModelStructure><Output valueReference="3"/><ContinuousStateDerivative valueReference="4"/>
<InitialUnknown valueReference="4"/><EventIndicator valueReference="5"/></ModelStructure></fmiModelDescription>"""
CO, ME = '<CoSimulation modelIdentifier="bare"/>', '<ModelExchange modelIdentifier="bare"/>'
SCHEDULED = '<ScheduledExecution modelIdentifier="bare"/>'
OSCILLATOR = """<ScalarVariable name="force" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="x" valueReference="1" causality="output" initial="exact"><Real start="0"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="2"><Real derivative="2"/></ScalarVariable>"""


def bare_fmu(path: Path, description: str, more: dict[str, bytes] | None = None) -> Path:
    """An FMU with this description, without a library unless `more` has one."""
    return write_archive(path, {"modelDescription.xml": description.encode(), **(more or {})})


def fmi_1(path: Path, co_simulation: bool) -> Path:
    """An FMU of FMI 1.0; one of co-simulation has an Implementation."""
    return bare_fmu(path, ONE.replace("{more}", STANDALONE if co_simulation else ""))


def fmi_2(path: Path, kinds: str = CO + ME, variables: str = OSCILLATOR, name: str = "bare", tool: str = "a tool") -> Path:
    """An FMU of FMI 2.0 with these variables, one of which may be a state called x."""
    structure = (
        "<Outputs><Unknown index='2'/></Outputs><Derivatives><Unknown index='3'/></Derivatives>" if variables == OSCILLATOR else ""
    )
    return bare_fmu(path, TWO.format(name=name, tool=tool, kinds=kinds, variables=variables, structure=structure))


def fmi_3(path: Path, kinds: str) -> Path:
    """An FMU of FMI 3.0 with arrays, whose sizes follow the structural parameter n = 3."""
    return bare_fmu(path, THREE.format(kinds=kinds))


def large(path: Path, count: int) -> Path:
    """An FMU of FMI 2.0 with so many inputs, outputs and parameters in turn."""
    kinds = (("input", "continuous"), ("output", "continuous"), ("parameter", "fixed"))
    lines = []
    for i in range(count):
        causality, variability = kinds[i % 3]
        start = "" if causality == "output" else ' start="1"'
        lines.append(
            f'<ScalarVariable name="body[{i}].x" valueReference="{i}" causality="{causality}" variability="{variability}">'
            f"<Real{start}/></ScalarVariable>"
        )
    return fmi_2(path, CO, "".join(lines))

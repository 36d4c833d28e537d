"""Random SSP documents of versions 1.0 and 2.0, for property tests. Each strategy is made once: making one takes longer than drawing."""

from __future__ import annotations

from functools import cache

from hypothesis import strategies as st
from lxml import etree

from shaper_fmu.ssp import document as d
from shaper_fmu.ssp.names import INTEGER_BITS, KINDS_1, KINDS_2, PREFIXES, REAL_TYPES, TYPES_1, TYPES_2

WORDS = st.text(st.characters(exclude_categories=["Cc", "Cs"], exclude_characters="\ufffe\uffff"), min_size=1, max_size=6)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
SMALL = st.integers(-1000, 1000)
FOREIGN = "http://example.org/unknown"


def canonical(text: str) -> str:
    """As a reader keeps it: canonical XML."""
    declared = " ".join(f'xmlns:{prefix}="{uri}"' for prefix, uri in PREFIXES.items())
    node = etree.fromstring(f"<x {declared}>{text}</x>")[0]
    return etree.tostring(node, method="c14n", exclusive=True).decode()


def annotation(kind: str, text: str) -> d.Annotation:
    inner = f'<f:thing xmlns:f="{FOREIGN}" f:words="{text}"> <f:inner/>\n </f:thing>'
    return d.Annotation(type=kind, xml=canonical(f'<ssc:Annotation type="{kind}">{inner}</ssc:Annotation>'))


ANNOTATIONS = st.lists(st.builds(annotation, st.sampled_from(["org.example.a", "com.example"]), st.sampled_from("abc")), max_size=2)
GEOMETRY = canonical('<ssd:ElementGeometry x1="0" y1="0.5" x2="1" y2="2" rotation="90"/>')
CONNECTOR_GEOMETRY = canonical('<ssd:ConnectorGeometry x="0" y="0.5"/>')
CONNECTION_GEOMETRY = canonical('<ssd:ConnectionGeometry pointsX="1 2" pointsY="3 4"/>')
SYSTEM_EXTRA = [
    canonical('<ssd:SystemGeometry x1="0" y1="0" x2="9" y2="9"/>'),
    canonical('<ssd:GraphicalElements><ssd:Note x1="0" y1="0" x2="1" y2="1" text="a  b"/></ssd:GraphicalElements>'),
]


def kept(*known: str):
    """Some of these elements, as they are kept."""
    return st.lists(st.sampled_from(known), max_size=1)


def node(**more):
    return {"description": st.none() | WORDS, "annotations": ANNOTATIONS, **more}


SYMBOLS: tuple[str, ...] = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@cache
def units():
    exponents = st.dictionaries(st.sampled_from(SYMBOLS), st.integers(-3, 3).filter(bool), max_size=3)
    unit = st.builds(d.Unit, WORDS, exponents.map(_in_order), st.floats(1e-6, 1e6), NUMBERS, **node())
    return st.lists(unit, max_size=3, unique_by=lambda made: made.name)


def _in_order(exponents: dict[str, int]) -> dict[str, int]:
    return {symbol: exponents[symbol] for symbol in SYMBOLS if symbol in exponents}


@cache
def enumerations():
    items = st.dictionaries(WORDS, SMALL, min_size=1, max_size=3)
    return st.lists(st.builds(d.Enumeration, WORDS, items, **node()), max_size=2)


@cache
def data_types(version: str):
    def made(name: str, unit: str | None, other: str) -> d.DataType:
        attributes = {"mime-type": "text/x"} if name == "Binary" else {}
        return d.DataType(name, unit if name in REAL_TYPES else None, other if name == "Enumeration" else None, attributes)

    return st.builds(made, st.sampled_from(TYPES_1 if version == "1.0" else TYPES_2), st.none() | WORDS, WORDS)


@cache
def transformations():
    flags = st.sampled_from(["true", "false"])
    whole = SMALL.map(str)
    table = {"Boolean": flags, "Integer": whole, "Enumeration": WORDS}
    mappings = [
        st.builds(
            d.MappingTransformation,
            st.just(kind),
            st.dictionaries(values, values, min_size=1, max_size=2).map(lambda found: list(found.items())),
        )
        for kind, values in table.items()
    ]
    return st.one_of(st.none(), st.builds(d.LinearTransformation, NUMBERS, NUMBERS), *mappings)


@cache
def dimensions(version: str):
    if version == "1.0":
        return st.just([])
    fixed = st.builds(d.Dimension, st.integers(0, 9))
    return st.lists(fixed | st.builds(d.Dimension, st.none(), WORDS), max_size=2)


@cache
def parameters(version: str):
    def made(name: str, kind: str, number: float, whole: int, flag: bool, text: str, more: bool, rest: dict) -> d.Parameter:
        value = {"Boolean": str(flag).lower(), "Binary": "0aff"}.get(kind, text)
        value = repr(number) if kind in REAL_TYPES else str(whole) if kind in INTEGER_BITS else value
        items = [value, value] if more and kind in ("String", "Enumeration", "Binary") else []
        unit = text if kind in REAL_TYPES and more else None
        enumeration = text if kind == "Enumeration" and more else None
        return d.Parameter(name, kind, None if items else value, unit, enumeration, items, **rest)

    kinds = [kind for kind in (TYPES_1 if version == "1.0" else TYPES_2) if kind != "Clock"]
    more = st.just(False) if version == "1.0" else st.booleans()
    number = st.floats(width=32, allow_nan=False, allow_infinity=False)
    return st.builds(
        made, WORDS, st.sampled_from(kinds), number, st.integers(0, 100), st.booleans(), WORDS, more, st.fixed_dictionaries(node())
    )


@cache
def parameter_sets(version: str):
    more = node(version=st.just(version))
    return st.builds(d.ParameterSet, WORDS, st.lists(parameters(version), max_size=3), enumerations(), units(), **more)


@cache
def mappings(version: str):
    entry = st.builds(d.MappingEntry, WORDS, WORDS, transformations(), st.booleans(), **node())
    return st.builds(d.ParameterMapping, st.lists(entry, max_size=3), **node(version=st.just(version)))


@cache
def dictionaries(version: str):
    sizes = st.just([]) if version == "1.0" else st.lists(st.builds(d.Dimension, st.integers(0, 9)), max_size=1)
    entry = st.builds(d.DictionaryEntry, WORDS, data_types(version), sizes, **node())
    return st.builds(d.SignalDictionary, st.lists(entry, max_size=3), enumerations(), units(), **node(version=st.just(version)))


@cache
def bindings(version: str):
    sources = st.sampled_from(["resources/a.ssv", "b.ssv"])
    bases = st.sampled_from(["SSD", "component"])
    mapping = st.builds(d.MappingReference, sources, source_base=bases) | st.builds(
        d.MappingReference, mapping=mappings(version), description=st.none() | WORDS
    )
    prefix, rest = st.just("") | WORDS, node()
    return st.builds(
        d.ParameterBinding, sources, prefix=prefix, mapping=st.none() | mapping, source_base=bases, **rest
    ) | st.builds(d.ParameterBinding, values=parameter_sets(version), prefix=prefix, mapping=st.none() | mapping, **rest)


@cache
def connectors(version: str):
    kinds = st.sampled_from(KINDS_1 if version == "1.0" else KINDS_2)
    clocks = st.just([]) if version == "1.0" else st.lists(WORDS, max_size=1)
    rest = node(extra=kept(CONNECTOR_GEOMETRY))
    return st.builds(d.Connector, WORDS, kinds, st.none() | data_types(version), dimensions(version), clocks, **rest)


@cache
def connections(version: str):
    indices = st.just([]) if version == "1.0" else st.lists(st.integers(0, 9), max_size=2)
    rest = node(extra=kept(CONNECTION_GEOMETRY))
    ends = (st.none() | WORDS, WORDS, st.none() | WORDS, WORDS)
    return st.builds(d.Connection, *ends, transformations(), st.booleans(), indices, indices, **rest)


def interface(version: str):
    return {
        "connectors": st.lists(connectors(version), max_size=2),
        "bindings": st.lists(bindings(version), max_size=1),
        **node(extra=kept(GEOMETRY)),
    }


@cache
def systems(version: str):
    shared = interface(version)
    how = ["any", "CoSimulation", "ModelExchange"]
    sources = st.just("resources/x.fmu") if version == "1.0" else st.none() | st.just("resources/x.fmu")
    component = st.builds(d.Component, WORDS, source=sources, implementation=st.sampled_from(how), **shared)
    reference = st.builds(d.DictionaryReference, WORDS, dictionary=WORDS, **shared)
    source = st.builds(d.DictionarySource, WORDS, source=st.just("a.ssb")) | st.builds(
        d.DictionarySource, WORDS, dictionary=dictionaries(version)
    )

    def system(inner):
        return st.builds(
            d.SystemElement,
            WORDS,
            elements=st.lists(inner, max_size=3),
            connections=st.lists(connections(version), max_size=2),
            dictionaries=st.lists(source, max_size=1),
            **{**shared, "extra": kept(*SYSTEM_EXTRA, GEOMETRY)},
        )

    leaves = component | reference
    return system(st.recursive(leaves, system, max_leaves=4))


@cache
def descriptions(version: str):
    experiment = st.builds(d.DefaultExperiment, st.none() | NUMBERS, st.none() | NUMBERS, annotations=ANNOTATIONS)
    own = st.sampled_from([{}, {"own": FOREIGN}])
    attributes = st.sampled_from([{}, {"author": "A. B.", "generationTool": "x"}])
    rest = node(version=st.just(version), namespaces=own, attributes=attributes)
    return st.builds(d.SystemDescription, WORDS, systems(version), enumerations(), units(), st.none() | experiment, **rest)

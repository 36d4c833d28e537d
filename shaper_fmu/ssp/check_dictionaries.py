"""Checks of signal dictionaries: references to none, connectors that are no signals, and signals with two sources."""

from __future__ import annotations

from collections.abc import Mapping

from shaper_fmu.errors import nearest
from shaper_fmu.ssp.check_scene import Scene, check_declarations, do_not_convert, duplicates
from shaper_fmu.ssp.check_structure import Place, check_type, label
from shaper_fmu.ssp.document import DictionaryReference, DictionarySource, SignalDictionary, SystemElement
from shaper_fmu.ssp.names import DICTIONARY_TYPE
from shaper_fmu.ssp.read import read_dictionary

Ends = tuple[Place, str]
Known = Mapping[str, tuple[Place, SignalDictionary | None]]
"""The dictionaries that references of a system can name: their place, and what they say, None if that cannot be read."""


def check_dictionaries(scene: Scene, directed: Mapping[Ends, Ends]) -> None:
    """Check all dictionaries and references; `directed` are the connections, destination -> source."""
    drivers: dict[tuple[Place, str, str], str] = {}
    _check_system(scene, (), scene.description.system, {}, directed, drivers)


def _check_system(
    scene: Scene,
    place: Place,
    system: SystemElement,
    outer: Known,
    directed: Mapping[Ends, Ends],
    drivers: dict[tuple[Place, str, str], str],
) -> None:
    known = {**outer, **{source.name: (place, _dictionary(scene, source)) for source in system.dictionaries}}
    for element in system.elements:
        inner = (*place, element.name)
        if isinstance(element, SystemElement):
            _check_system(scene, inner, element, known, directed, drivers)
        elif isinstance(element, DictionaryReference):
            if element.dictionary not in known:
                words = f"{label(inner)} stands for the signal dictionary {element.dictionary!r}, which is none"
                scene.tell(element.line, f"{words}.{nearest(element.dictionary, known)}")
                continue
            home, dictionary = known[element.dictionary]
            for connector in element.connectors:
                if dictionary is not None:
                    _check_signal(scene, inner, element, connector.name, dictionary)
                source = directed.get((inner, connector.name))
                if source is not None:
                    name = label(*source)
                    other = drivers.setdefault((home, element.dictionary, connector.name), name)
                    if other != name:
                        signal = f"signal {connector.name!r} of the dictionary {element.dictionary!r}"
                        scene.tell(connector.line, f"{signal} is driven twice: by {other} and by {name}")


def _dictionary(scene: Scene, source: DictionarySource) -> SignalDictionary | None:
    what = f"signal dictionary {source.name!r}"
    if source.type != DICTIONARY_TYPE:
        scene.tell(source.line, f"{what} is of type {source.type!r}, which is not read")
        return None
    if (source.source is None) == (source.dictionary is None):
        both = "both a source and entries inline" if source.source is not None else "neither a source nor entries inline"
        scene.tell(source.line, f"{what} has {both}")
    found, file = source.dictionary, scene.file
    if found is None and source.source is not None:
        file = scene.resource(source.source, source.line, what) or ""
        document = scene.document(file, read_dictionary) if file else None
        found = document if isinstance(document, SignalDictionary) else None
    if found is not None:
        check_declarations(scene, found, file)
        for entry in found.entries:
            check_type(scene, entry.type, f"signal {entry.name}", entry.line, found, file)
        for name in sorted(duplicates(entry.name for entry in found.entries)):
            line = [entry.line for entry in found.entries if entry.name == name][1]
            scene.tell(line, f"signal {name!r} is there twice", file)
    return found


def _check_signal(scene: Scene, place: Place, reference: DictionaryReference, name: str, dictionary: SignalDictionary) -> None:
    connector = reference.connector(name)
    assert connector is not None
    entry = next((entry for entry in dictionary.entries if entry.name == name), None)
    what = f"connector {label(place, name)}"
    if entry is None:
        known = nearest(name, [entry.name for entry in dictionary.entries])
        scene.tell(connector.line, f"{what} is no signal of the dictionary {reference.dictionary!r}.{known}")
    elif connector.type is not None:
        own, signal = scene.meaning(connector.type), scene.meaning(entry.type, dictionary)
        if own.kind != signal.kind:
            scene.tell(connector.line, f"{what} is of type {connector.type.name}, but {entry.type.name} in the dictionary")
        elif do_not_convert(own, signal):
            scene.tell(connector.line, f"{what} is in {own.unit}, which does not convert to {signal.unit} of the dictionary")

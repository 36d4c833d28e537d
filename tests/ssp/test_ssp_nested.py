"""Nested systems, dictionaries, transformations and parameters of SSP archives, through real FMUs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ssp_archives import archive, binding, bindings, component, connection, connectors, linear, ssd, ssv, system, table

from shaper_fmu.errors import ArchiveError, ModelError
from shaper_fmu.master.system import System
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.loaded import SspSystem

PLANT, PULSE, SHAPER, PROFILE = "MassSpringDamper", "PulseTrain", "InputShaper", "MotionProfile"


@pytest.fixture
def load(fmus, tmp_path):
    """Load a system from what is in its root system."""

    def loaded(root: str, variant: str | None = None, version: str = "1.0", more: str = "", **files: bytes) -> SspSystem:
        path = archive(tmp_path, fmus, ssd(root, version, more), PLANT, PULSE, SHAPER, PROFILE, **files)
        return load_ssp(path, variant)

    return loaded


def mass_of(loaded: SspSystem, instance: str = "plant") -> float:
    return loaded.system.start_values[instance]["mass"]


def moved(fmus: Path, force: float = 1.0, **values: float) -> np.ndarray:
    """The position of the plant under a constant force."""
    plant = System()
    plant.add("plant", fmus / f"{PLANT}.fmu", force=force, **values)
    return plant.simulate(1.0, 0.01, record=["plant.position"])["plant.position"]


# Nested systems.


def test_a_path_through_two_levels_composes_units_and_transformations(load, fmus):
    """Outer kN -> N: 1000; inner connector declares kN, and its own connection doubles and adds 3 N, after the conversion."""
    inner = system(
        connectors("f input kN", "x output mm"),
        component("plant", PLANT),
        connection("f", "plant.force", linear(2.0, 3.0)) + connection("plant.position", "x"),
        name="inner",
    )
    root = system(
        connectors("force input N", "x output"),
        inner,
        connection("force", "inner.f") + connection("inner.x", "x", linear(10.0)),
    )
    loaded = load(root)
    loaded.set("force", 4.0)
    assert loaded.system.start_values["inner.plant"] == {"force": 2.0 * 4.0 + 3.0}
    results = loaded.simulate(1.0, 0.01)
    expected = moved(fmus, 11.0)
    assert results["inner.plant.position"].tobytes() == expected.tobytes()
    assert np.abs(results["x"] - 10.0 * 1000.0 * expected).max() <= 1e-15 * np.abs(10_000.0 * expected).max()
    assert results.units["x"] == "mm"
    assert set(loaded.simulate(0.1, 0.01, record=["x"]).values) == {"x"}
    assert set(loaded.simulate(0.1, 0.01, record=["inner.plant.velocity", "x"]).values) == {"inner.plant.velocity", "x"}


def test_a_nested_system_runs_as_the_flat_one(load, fmus):
    inner = system(
        connectors("f input", "x output"),
        component("plant", PLANT),
        connection("f", "plant.force") + connection("plant.position", "x"),
        name="inner",
    )
    root = system("", component("train", PULSE) + inner, connection("train.pulse", "inner.f"))
    nested = load(root).simulate(1.0, 0.01)
    flat = System()
    flat.add("train", fmus / f"{PULSE}.fmu")
    flat.add("plant", fmus / f"{PLANT}.fmu")
    flat.connect("train.pulse", "plant.force")
    expected = flat.simulate(1.0, 0.01)
    assert np.abs(expected["plant.position"]).max() > 0.0
    for name in ("position", "velocity"):
        assert nested[f"inner.plant.{name}"].tobytes() == expected[f"plant.{name}"].tobytes()


def test_start_and_end_tell_no_direction(load):
    """ "The terms start and end do not denote directionality": the kinds of the connectors do."""
    loaded = load(system("", component("train", PULSE) + component("plant", PLANT), connection("plant.force", "train.pulse")))
    assert loaded.system.connections == {("plant", "force"): ("train", "pulse")}


def test_inputs_of_the_system_can_be_driven(load, fmus):
    root = system(connectors("force input kN"), component("plant", PLANT), connection("force", "plant.force"))
    loaded = load(root)
    assert loaded.inputs == ["force"]
    open_input = "nothing feeds plant.force: left at the FMU's own start value"
    assert open_input in loaded.simulate(0.0, 0.01).notes
    loaded.drive("force", 0.002)
    assert open_input not in loaded.simulate(0.0, 0.01).notes
    assert loaded.simulate(1.0, 0.01)["plant.position"].tobytes() == moved(fmus, 2.0).tobytes()
    with pytest.raises(ModelError, match=r"no input 'forze'. Did you mean 'force'\?"):
        loaded.drive("forze", 1.0)


def test_a_signal_dictionary_connects_what_refers_to_it(load, fmus):
    """The train writes a signal of the outer system's dictionary in kN; a nested system reads it, under the dictionary's name."""
    dictionary = '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="resources/bus.ssb"/></ssd:SignalDictionaries>'
    entry = '<ssb:DictionaryEntry name="force"><ssc:Real unit="kN"/></ssb:DictionaryEntry>'
    units = ssv().partition("<ssv:Units>")[2].partition("</ssv:Units>")[0]
    bus = f'{ssv().partition(" version")[0].replace("ssv:ParameterSet", "ssb:SignalDictionary")} version="1.0">{entry}'
    bus += f"<ssb:Units>{units}</ssb:Units></ssb:SignalDictionary>"
    reference = '<ssd:SignalDictionaryReference name="{0}" dictionary="bus">{1}</ssd:SignalDictionaryReference>'
    reader = system(
        "",
        component("plant", PLANT) + reference.format("in", connectors("force output")),
        connection("in.force", "plant.force", linear(0.5)),
        name="inner",
    )
    elements = component("train", PULSE) + reference.format("out", connectors("force inout")) + reader
    root = system("", elements, connection("train.pulse", "out.force")) + dictionary
    loaded = load(root, resources__bus_ssb=bus.encode())
    assert loaded.system.connections == {("inner.plant", "force"): ("train", "pulse")}
    unit = loaded.system.unit(("train", "pulse"))
    gain, offset = loaded.system.scalings["inner.plant", "force"]
    assert (unit, offset) in (("", 0.0), ("N", 0.0))
    # without a unit, the pulse is a number of kN
    assert gain == pytest.approx(0.5 if unit == "N" else 500.0, rel=1e-15)


def test_a_component_may_be_another_description(load):
    """Its bindings in the outer file count as the last ones of the inner root system."""
    inner = ssd(
        connectors("f input")
        + bindings(binding("plant.mass Real 5", "plant.damping Real 0.25"))
        + system("", component("plant", PLANT), connection("f", "plant.force"))
    )
    kind = 'type="application/x-ssp-definition"'
    part = f'<ssd:Component name="part" {kind} source="part.ssd">{bindings(binding("plant.mass Real 7"))}</ssd:Component>'
    loaded = load(system("", component("train", PULSE) + part, connection("train.pulse", "part.f")), part_ssd=inner)
    assert loaded.system.start_values["part.plant"] == {"mass": 7.0, "damping": 0.25}
    assert loaded.system.connections == {("part.plant", "force"): ("train", "pulse")}


def test_a_component_may_be_another_archive(load, fmus, tmp_path):
    """Its default description or a variant; its paths are relative to itself."""
    (tmp_path / "inner").mkdir()
    heavy = ssd(system("", component("plant", PLANT, binding("mass Real 50"))))
    inner = archive(
        tmp_path / "inner", fmus, ssd(system("", component("plant", PLANT, binding("mass Real 5")))), PLANT, Heavy_ssd=heavy
    )
    for fragment, mass in (("", 5.0), ("#Heavy.ssd", 50.0)):
        part = f'<ssd:Component name="part" type="application/x-ssp-package" source="resources/part.ssp{fragment}"/>'
        assert mass_of(load(system("", part), resources__part_ssp=inner.read_bytes()), "part.plant") == mass


def test_a_description_in_itself_is_refused(load):
    part = '<ssd:Component name="{}" type="application/x-ssp-definition" source="SystemStructure.ssd"/>'
    with pytest.raises(ModelError, match="nested deeper than 32 levels, or in itself"):
        load(system("", part.format("a")))
    with pytest.raises(ModelError, match="more than 20000 elements"):
        load(system("", part.format("a") + part.format("b")))


# Transformations of connections.


def test_a_connection_may_keep_units_as_they_are(load):
    root = system(
        connectors("force input kN"), component("plant", PLANT), connection("force", "plant.force", suppressUnitConversion="true")
    )
    loaded = load(root)
    loaded.set("force", 4.0)
    assert loaded.system.start_values["plant"]["force"] == 4.0


def test_units_that_do_not_convert_are_refused(load):
    root = system("", component("profile", PROFILE) + component("plant", PLANT), connection("profile.position", "plant.force"))
    with pytest.raises(ModelError, match=r"line 3: profile.position -> plant.force: unit m does not convert to N"):
        load(root)


def test_an_input_has_one_source(load):
    twice = connection("train.pulse", "plant.force") * 2
    with pytest.raises(ModelError, match=r"plant.force is driven twice: by train.pulse, and by train.pulse in line 3"):
        load(system("", component("train", PULSE) + component("plant", PLANT), twice))


def test_two_outputs_cannot_be_connected(load):
    root = system("", component("train", PULSE) + component("plant", PLANT), connection("train.pulse", "plant.position"))
    with pytest.raises(
        ModelError,
        match=r"train\.pulse -> plant\.position: an output of an element and an output of an element cannot be connected",
    ):
        load(root)


# Parameters.


def test_outer_levels_count_more_and_later_bindings_too(load):
    plant = component("plant", PLANT, binding("mass Real 2", "stiffness Real 50", "damping Real 1"), binding("mass Real 3"))
    assert load(system("", plant)).system.start_values["plant"] == {"mass": 3.0, "stiffness": 50.0, "damping": 1.0}
    inner = system(bindings(binding("plant.mass Real 4", "plant.damping Real 9")), plant, name="inner")
    values = load(system("", inner)).system.start_values["inner.plant"]
    assert (values["mass"], values["stiffness"], values["damping"]) == (4.0, 50.0, 9.0)
    outer = bindings(binding("inner.plant.mass Real 5"), binding("inner.plant.mass Real 6"))
    assert mass_of(load(system(outer, inner)), "inner.plant") == 6.0


def test_units_prefixes_and_mappings(load):
    """2500 g are 2.5 kg; the entry's factor comes after the conversion; only what the mapping names is applied, prefixed."""
    entry = f'<ssm:MappingEntry source="p.m" target="plant.mass">{linear(2.0, 1.0)}</ssm:MappingEntry>'
    root = bindings(binding("m Real 2500 g", "plant.damping Real 3", mapping=entry, prefix="p."))
    loaded = load(root + system("", component("plant", PLANT)))
    assert loaded.system.start_values["plant"] == {"mass": 2.0 * 2.5 + 1.0}
    suppressed = entry.replace('">', '" suppressUnitConversion="true">', 1)
    root = bindings(binding("m Real 2500 g", mapping=suppressed, prefix="p."))
    assert mass_of(load(root + system("", component("plant", PLANT)))) == 2.0 * 2500.0 + 1.0
    root = bindings(binding("mass Real 2500 g", prefix="plant."))
    assert mass_of(load(root + system("", component("plant", PLANT)))) == 2.5
    with pytest.raises(ModelError, match=r"parameter plant\.mass -> plant\.mass: unit mm does not convert to kg"):
        load(bindings(binding("plant.mass Real 1 mm")) + system("", component("plant", PLANT)))


def test_mappings_of_booleans_integers_and_enumerations(load):
    entries = "".join(
        f'<ssm:MappingEntry source="{source}" target="shaper.{target}">{inner}</ssm:MappingEntry>'
        for source, target, inner in (
            ("kind", "shaper", table("Enumeration", robust="zvd")),
            ("kind_too", "modes", table("Integer", of_7="2")),
            ("off", "shape_mode[1]", table("Boolean", true="false")),
            ("off", "shape_mode[2]", ""),
        )
    )
    given = binding("kind Enumeration robust", "kind_too Integer 7", "off Boolean true", mapping=entries)
    values = load(bindings(given) + system("", component("shaper", SHAPER))).system.start_values["shaper"]
    assert (values["modes"], values["shape_mode[1]"], values["shape_mode[2]"]) == (2, False, True)
    assert values["shaper"] == 3  # zvd, the third item


def test_a_parameter_of_the_system_goes_to_all_it_is_connected_with(load, fmus):
    """In t (of 1000 kg, as a unit of its own), to two plants, to one of them halved; an outer value counts more than inner ones."""
    inner = system(
        connectors("m parameter g"),
        component("a", PLANT, binding("mass Real 9")) + component("b", PLANT),
        connection("m", "a.mass") + connection("m", "b.mass", linear(0.5)),
        name="inner",
    )
    root = connectors("load parameter kg") + bindings(binding("load Real 8")) + system("", inner, connection("load", "inner.m"))
    loaded = load(root)
    assert (mass_of(loaded, "inner.a"), mass_of(loaded, "inner.b")) == (8.0, 4.0)
    loaded.set("load", 10.0)
    loaded.set("inner.b.stiffness", 7.0)
    assert (mass_of(loaded, "inner.a"), mass_of(loaded, "inner.b")) == (10.0, 5.0)
    assert loaded.system.start_values["inner.b"]["stiffness"] == 7.0
    loaded.set("inner.m", "3000")
    assert (mass_of(loaded, "inner.a"), mass_of(loaded, "inner.b")) == (3.0, 1.5)
    with pytest.raises(ModelError, match=r"no instance 'lod'. Did you mean 'load'\?"):
        loaded.set("lod", 1.0)
    with pytest.raises(ModelError, match=r"^load = heavy: parameter load -> load: an enumeration cannot become a real"):
        loaded.set("load", "heavy")


def test_values_that_match_nothing_are_noted(load):
    loaded = load(system("", component("plant", PLANT, binding("mas Real 1"))))
    told = "parameter mas: plant has nothing called 'mas', so the value has no effect. Did you mean 'mass'?"
    assert any(note.endswith(told) for note in loaded.notes)


def test_a_wrong_value_is_refused_with_its_place(load):
    root = system("", component("plant", PLANT, '<ssd:ParameterBinding source="resources/p.ssv"/>'))
    values = ssv("damping Real 1", "mass Real heavy").encode()
    with pytest.raises(
        ModelError, match=r"resources/p\.ssv, line 2: parameter mass -> plant\.mass: 'heavy' is not a value of kind real"
    ):
        load(root, resources__p_ssv=values)


# Variants and version 2.0.


def test_variants_are_chosen_by_file_or_name(load):
    heavy = ssd(system("", component("plant", PLANT, binding("mass Real 50"))), name="heavy load")
    root = system("", component("plant", PLANT, binding("mass Real 5")))
    for variant, mass in ((None, 5.0), ("SystemStructure", 5.0), ("Heavy", 50.0), ("Heavy.ssd", 50.0), ("heavy load", 50.0)):
        assert mass_of(load(root, variant, Heavy_ssd=heavy)) == mass
    with pytest.raises(ArchiveError, match=r"no variant 'Haevy'. Did you mean 'Heavy'\?"):
        load(root, "Haevy", Heavy_ssd=heavy)


def test_version_2_types_and_arrays(load):
    """A Float64 with dimensions sets the elements of an array, one after the other."""
    values = ssv(version="2.0").replace(
        "<ssv:Parameters>",
        '<ssv:Parameters><ssv:Parameter name="stiffness"><ssv:Float64 value="7.5"/></ssv:Parameter>',
    )
    bound = f"<ssd:ParameterBinding><ssd:ParameterValues>{values}</ssd:ParameterValues></ssd:ParameterBinding>"
    loaded = load(system("", component("plant", PLANT, bound)), version="2.0")
    assert loaded.system.start_values["plant"]["stiffness"] == 7.5


def test_names_that_are_none_for_instances_are_replaced(load):
    loaded = load(system("", component("my plant", PLANT, binding("mass Real 3"))))
    assert mass_of(loaded, "my_plant") == 3.0
    assert "component 'my plant' is called my_plant here" in loaded.notes
    loaded.set("my plant.mass", 4.0)
    assert mass_of(loaded, "my_plant") == 4.0

"""FMUs for wasm32-wasip2 (draft of fmi-ls-wasm), run by wasmtime: values of plain Python, and all else as in the native FMU."""

from __future__ import annotations

import itertools
import math
import random
import zipfile
from ctypes import byref, c_byte, c_char_p, c_double, c_size_t, c_uint32, c_void_p
from functools import lru_cache
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import fmpy
import pytest
import wasmtime
from command_line import typed
from fmpy.validation import validate_fmu
from kernel_traces import traces
from lxml import etree
from native_calls import ERROR, OK, Host, array
from test_wasm import LOOSER, ROUNDING
from wasm_components import ENGINE, STATUSES, Guest, Instance

from shaper_fmu.errors import BuildError
from shaper_fmu.export.build import build_fmu, fmu_path
from shaper_fmu.export.native.toolchain import platform_named
from shaper_fmu.registry import components


@lru_cache
def fmu(name: str) -> Path:
    return fmu_path(name, 3, platforms=["this", "wasm32-wasip2"])


def started(name: str, kind: str = "co-simulation", logging: bool = False) -> Instance:
    one = Instance(Guest(fmu(name)), kind=kind, logging=logging)
    assert one.call("enter-initialization-mode", None, 0.0, None) == "ok"
    assert one.call("exit-initialization-mode") == "ok"
    return one


def native(name: str, exchange: bool = False, events: bool = False) -> Host:
    """The same from the native library."""
    host = Host(name, 3, exchange, events)
    assert host.setup() == host.call("ExitInitializationMode") == OK
    return host


@pytest.mark.representatives(name=["InputShaper", "MassSpringDamper"])
@pytest.mark.parametrize("name", components())
def test_the_component_computes_what_plain_python_does(name):
    """Every item of every enumeration, and random values, inputs and steps; what one refuses the other refuses."""
    component, guest, compared = components()[name], Guest(fmu(name)), 0
    for number, trace in enumerate(traces(component, random.Random(name), 2, steps=40)):
        one = Instance(guest, f"trace {number}")
        one.call("enter-initialization-mode", None, 0.0, None)
        set_all = [one.set(variable, value) for variable, value in trace["parameters"].items()]
        done = "ok" if one.call("exit-initialization-mode") == "ok" and set(set_all) <= {"ok"} else "error"
        assert (done == "ok") == (trace["started"] is not None), guest.log[-1:]
        compared += _compare(one, trace["started"] or {}, number, -1)
        for i, (inputs, t, h, expected) in enumerate(trace["steps"]):
            set_all = {one.set(variable, value) for variable, value in inputs.items()}
            found = one.call("do-step", t, h, False)
            assert (set_all <= {"ok"} and not isinstance(found, str)) == (expected is not None), (number, i, guest.log[-1:])
            compared += _compare(one, expected or {}, number, i)
        one.free()
    assert compared > 100


def _compare(one: Instance, expected: dict, number: int, step: int) -> int:
    name = one.guest.description.modelName
    for variable, value in expected.items():
        if variable not in one.variables:
            continue
        for found, true in zip(one.get(variable), value if isinstance(value, list) else [value], strict=True):
            difference = abs(float(found) - float(true)) / max(1.0, abs(float(true)))
            assert difference <= LOOSER.get(name, ROUNDING), (number, step, variable, found, true)
    return len(expected)


def test_the_component_has_the_worlds_of_the_draft_and_imports_nothing_else():
    """By its section 6.1: the FMU's kinds of simulation; no WASI, and no optional callbacks."""
    kinds = {"MassSpringDamper": ["co-simulation", "model-exchange"], "PositionController": ["co-simulation", "model-exchange"]}
    for name, expected in kinds.items():
        found = Guest(fmu(name)).component.type
        imports, exports = found.imports(ENGINE), found.exports(ENGINE)
        assert sorted(imports) == ["fmi:fmi3/callbacks@3.0.0", "fmi:fmi3/types@3.0.0"]
        assert sorted(exports) == sorted(f"fmi:fmi3/{one}@3.0.0" for one in ["common", *expected])


def test_the_version_and_a_host_without_callbacks():
    assert Guest(fmu("MassSpringDamper")).version() == "3.0"
    with pytest.raises(wasmtime.WasmtimeError, match="callbacks"):
        Guest(fmu("MassSpringDamper"), callbacks=False)


def test_messages_and_statuses_are_those_of_the_native_fmu():
    one, host = started("InputShaper", logging=True), native("InputShaper")
    reals = array(c_double, [1.0, 2.0])
    frequency = one.variables["natural_frequency"].valueReference
    tolerance = one.variables["vibration_tolerance"].valueReference
    cases = [
        (("get-float64", [9999]), ("GetFloat64", array(c_uint32, [9999]), 1, reals, 1)),
        (("get-int32", [frequency]), ("GetInt32", array(c_uint32, [frequency]), 1, reals, 1)),
        (("set-float64", [frequency], [1.0]), ("SetFloat64", array(c_uint32, [frequency]), 1, reals, 1)),
        (("set-float64", [tolerance], [1.0]), ("SetFloat64", array(c_uint32, [tolerance]), 1, reals, 1)),
        (("get-string", [frequency]), ("GetString", array(c_uint32, [frequency]), 1, array(c_void_p, [0]), 1)),
        (("get-uint8", [frequency]), ("GetUInt8", array(c_uint32, [frequency]), 1, reals, 4)),
        (("get-clock", [frequency]), ("GetClock", array(c_uint32, [frequency]), 1, reals)),
        (("enter-event-mode",), ("EnterEventMode",)),
        (("enter-configuration-mode",), ("EnterConfigurationMode",)),
        (("exit-initialization-mode",), ("ExitInitializationMode",)),
        (("set-debug-logging", True, ["logNothing"]), ("SetDebugLogging", True, 1, array(c_char_p, [b"logNothing"]))),
        (("do-step", 0.5, 0.1, False), ("DoStep", 0.5, 0.1, False, *[byref(c_double()) for _ in range(4)])),
        (("do-step", 0.0, -0.1, False), ("DoStep", 0.0, -0.1, False, *[byref(c_double()) for _ in range(4)])),
    ]  # fmt: skip
    for (method, *arguments), (function, *native_arguments) in cases:
        one.guest.log.clear()
        status = one.call(method, *arguments)
        assert STATUSES[host.call(function, *native_arguments)] == status == "error", method
        assert [(code, text) for code, text in host.log] == [(ERROR, text) for _, _, _, text in one.guest.log], method
        assert one.guest.log[0][:3] == ("one", "error", "logStatusError")
    assert one.call("get-string", []) == []


def test_texts_cross_the_border():
    """Names of instances in any script; a message that is cut within a character is still text."""
    guest = Guest(fmu("MassSpringDamper"))
    one = Instance(guest, "Kran – 起重机 🏗")
    one.call("get-float64", [0])
    assert guest.log[-1][0] == "Kran – 起重机 🏗"
    for token in ("ü" * 3000, "x" + "ü" * 3000, "起" * 3000, "x" + "起" * 3000, "🏗" * 3000, "xyz" + "🏗" * 3000):
        assert Instance(guest, "two", token=token).handle is None
        assert guest.log[-1][3].startswith(f"MassSpringDamper: the token {token[:100]}"), token[:3]
    assert Instance(guest, "").handle is None
    assert guest.log[-1][3] == "MassSpringDamper: an instance needs a name"


def test_instances_give_their_memory_back():
    """100 of 300 kB after each other, and many calls, in 8 MB."""
    guest = Guest(fmu("InputShaper"))
    guest.store.set_limits(memory_size=8 << 20)
    for _ in range(100):
        one = Instance(guest)
        assert one.handle is not None
        one.free()
    one = Instance(guest)
    one.call("enter-initialization-mode", None, 0.0, None)
    references = [one.variables["natural_frequency"].valueReference] * 50
    for _ in range(3000):  # 1.6 kB each; what is not given back would be 5 MB
        assert one.call("set-debug-logging", True, ["logStatusError"] * 100) == "ok"
    for _ in range(30):
        assert one.call("get-float64", references) == one.get("natural_frequency") * 50
    assert one.call("set-fmu-state", one.call("get-fmu-state")) == "ok"


def test_instances_of_a_guest_are_apart():
    guest = Guest(fmu("InputShaper"))
    one, other = Instance(guest, "one"), Instance(guest, "other")
    for instance in (one, other):
        instance.call("enter-initialization-mode", 1e-6, 0.0, 10.0)
        instance.set("natural_frequency", [5.0, 14.0, 20.0, 30.0])
        assert instance.call("exit-initialization-mode") == "ok"
    one.set("command", 1.0)
    one.call("do-step", 0.0, 0.5, False)
    assert one.get("shaped") != [0.0]
    assert other.get("shaped") == [0.0]
    one.free()
    other.set("command", 1.0)
    other.call("do-step", 0.0, 0.5, False)
    assert other.call("terminate") == other.call("reset") == "ok"
    assert other.call("do-step", 0.0, 0.5, False) == "error"
    assert guest.log[-1][3] == "InputShaper: fmi3DoStep cannot be called before initialization"
    with pytest.raises(wasmtime.WasmtimeError):
        one.call("reset")


def test_states_replay_and_are_those_of_the_native_library():
    """The bytes of a state are the same in both, so that one goes on where the other stopped."""
    one, host = started("InputShaper"), native("InputShaper")
    for i in range(20):
        one.set("command", float(i < 5))
        host.put(one.variables["command"], float(i < 5))
        one.call("do-step", i * 0.05, 0.05, False)
        assert host.step(i * 0.05, 0.05) == OK
    state, handle, size = one.call("get-fmu-state"), c_void_p(), c_size_t()
    assert host.call("GetFMUState", byref(handle)) == host.call("SerializedFMUStateSize", handle, byref(size)) == OK
    assert size.value == len(state)
    after = [run(one, 20) for _ in range(2) if one.call("set-fmu-state", state) == "ok"]
    assert after[0] == after[1]
    restored = c_void_p()
    assert host.call("DeserializeFMUState", array(c_byte, list(memoryview(state).cast("b"))), len(state), byref(restored)) == OK
    assert host.call("SetFMUState", restored) == OK
    for i, values in enumerate(after[0]):
        assert host_results(host, one, 20 + i) == pytest.approx(values, abs=ROUNDING)
    assert one.call("set-fmu-state", state[:-1]) == one.call("set-fmu-state", b"") == "error"
    assert one.call("set-fmu-state", bytes([state[0] ^ 1]) + state[1:]) == "error"
    assert one.guest.log[-1][3] == "InputShaper: the serialized state is damaged"
    assert one.call("set-fmu-state", started("MassSpringDamper").call("get-fmu-state")) == "error"
    assert run(one, 30) != after[0]


def run(one: Instance, first: int) -> list[list[float]]:
    found = []
    for i in range(first, first + 10):
        one.set("command", 0.5)
        one.call("do-step", i * 0.05, 0.05, False)
        found.append(one.results())
    return found


def host_results(host: Host, one: Instance, i: int) -> list[float]:
    host.put(one.variables["command"], 0.5)
    assert host.step(i * 0.05, 0.05) == OK
    found = []
    for v in one.variables.values():
        if v.causality == "output":
            value = array(host.types[v.type], [0])
            assert host.access("Get", v.type, array(c_uint32, [v.valueReference]), 1, value, 1) == OK
            found.append(float(value[0]))
    return found


def test_event_mode_and_early_return():
    """A step of InputShaper ends where the second impulse falls: ZV for 10 rad/s, half a period later."""
    one = Instance(Guest(fmu("InputShaper")), events=True, early=True)
    one.call("enter-initialization-mode", None, 0.0, None)
    one.call("exit-initialization-mode")
    one.call("update-discrete-states")
    one.set("command", 1.0)
    info = one.call("update-discrete-states")
    due = getattr(info, "next-event-time")
    assert getattr(info, "next-event-time-defined")
    assert due == pytest.approx(math.pi / 10.0, rel=1e-12)
    assert not getattr(info, "new-discrete-states-needed")
    assert not getattr(info, "terminate-simulation")
    assert one.call("enter-step-mode") == "ok"
    step = one.call("do-step", 0.0, 2.0 * due, False)
    assert (getattr(step, "early-return"), getattr(step, "event-handling-needed")) == (True, True)
    assert getattr(step, "last-successful-time") == pytest.approx(due, rel=1e-12)
    before = one.get("shaped")
    assert one.call("enter-event-mode") == "ok"
    one.call("update-discrete-states")
    assert before[0] == pytest.approx(0.5, abs=0.05)
    assert one.get("shaped") == [1.0]


def test_wanted_intermediate_updates_are_warned_of():
    """The component does not import them, since the world of model exchange has none."""
    guest = Guest(fmu("MassSpringDamper"))
    one = Instance(guest, early=True, required=(Instance(guest).variables["position"].valueReference,))
    assert one.handle is not None
    assert guest.log[-1][1:3] == ("warning", "logStatusWarning")
    assert "no intermediate updates in WebAssembly" in guest.log[-1][3]
    assert Instance(guest, required=(9999,)).handle is None


def test_model_exchange_is_that_of_the_native_library():
    """Derivatives of m x'' + c x' + k x = F, and directional ones: k, c and 1 over the mass."""
    one = started("MassSpringDamper", "model-exchange")
    m, k, c = (one.get(name)[0] for name in ("mass", "stiffness", "damping"))
    assert one.call("get-number-of-continuous-states") == 2
    assert one.call("get-number-of-event-indicators") == 0
    assert one.call("get-event-indicators") == []
    assert getattr(one.call("update-discrete-states"), "next-event-time-defined") is False
    assert one.call("enter-continuous-time-mode") == "ok"
    assert one.call("set-time", 0.25) == "ok"
    one.set("force", 3.0)
    assert one.call("set-continuous-states", [0.01, -0.2]) == "ok"
    assert one.call("get-continuous-states") == [0.01, -0.2]
    assert one.call("get-continuous-state-derivatives") == pytest.approx([-0.2, (3.0 - c * -0.2 - k * 0.01) / m], rel=1e-14)
    assert len(one.call("get-nominals-of-continuous-states")) == 2
    done = one.call("completed-integrator-step", True)
    assert (getattr(done, "enter-event-mode"), getattr(done, "terminate-simulation")) == (False, False)
    unknown = one.variables["acceleration"].valueReference
    knowns = [one.variables[name].valueReference for name in ("force", "position", "velocity")]
    for seed, expected in (([1.0, 0.0, 0.0], 1 / m), ([0.0, 1.0, 0.0], -k / m), ([0.0, 0.0, 1.0], -c / m)):
        assert one.call("get-directional-derivative", [unknown], knowns, seed) == pytest.approx([expected], rel=1e-9)
    assert one.call("get-adjoint-derivative", [unknown], knowns, [1.0]) == "error"
    assert one.call("set-continuous-states", [1.0]) == one.call("enter-step-mode") == "error"
    assert one.call("enter-event-mode") == one.call("terminate") == "ok"


def test_output_derivatives_and_what_fmi_3_does_not_have():
    one = started("MassSpringDamper")
    one.set("force", 1.0)
    one.call("do-step", 0.0, 0.1, False)
    position = one.variables["position"].valueReference
    assert one.call("get-output-derivatives", [(position, 1), (position, 2)]) == [*one.get("velocity"), *one.get("acceleration")]
    assert one.call("get-output-derivatives", [(position, 2**32 - 1)]) == "error"
    assert one.call("set-input-derivatives", [(position, 1)], [0.0]) == "error"
    assert one.guest.log[-1][3] == "MassSpringDamper: FMI 3.0 has no derivatives of inputs"
    assert one.call("get-number-of-variable-dependencies", position) == "error"
    assert one.call("get-variable-dependencies", position) == one.call("get-interval-decimal", [position]) == "error"
    assert one.call("set-interval-fraction", [position], []) == one.call("set-binary", [position], [b"x"]) == "error"
    assert one.call("set-string", [position], ["x"]) == "error"


def test_the_fmu_is_valid_and_its_manifests_are_those_of_a_layered_standard():
    """By fmpy, and by the schema of FMI 3.0.1; the names that the draft asks for."""
    path = fmu("MassSpringDamper")
    assert not validate_fmu(str(path))
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3LayeredStandardManifest.xsd"))
    with zipfile.ZipFile(path) as archive:
        for name in ("manifest.xml", "fmi-ls-manifest.xml"):
            root = etree.fromstring(archive.read(f"extra/org.modelica.fmi-ls-wasm/{name}"))
            schema.assertValid(root)
            told = {str(key).rpartition("}")[2]: value for key, value in root.attrib.items()}
            assert told["fmi-ls-name"] == "org.modelica.fmi-ls-wasm"
            assert told["fmi-ls-description"] == "FMI Layered Standard for WebAssembly"
    assert fmpy.simulate_fmu(str(path), stop_time=0.1)["position"].tolist()  # by its native library


def test_the_command_line_builds_names_and_refuses(tmp_path):
    done = typed("build", "PositionController", "--fmi", "3", "--platform", "this", "--platform", "wasm32-wasip2", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "wasm32-wasip2" in typed("info", "fmus/PositionController.fmu", cwd=tmp_path).stdout
    checked = typed("check", "fmus/PositionController.fmu", cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout
    for arguments in (["build", "PositionController"], ["build", "PositionController", "--backend", "python"]):
        refused = typed(*arguments, "--platform", "wasm32-wasip2", cwd=tmp_path)
        assert refused.returncode == 2
        assert "wasm32-wasip2 is not for FMI 2.0" in " ".join(refused.stderr.split())
    with pytest.raises(BuildError, match=r"wasm32-wasip2 is not for systems"):
        platform_named("wasm32-wasip2")
    with pytest.raises(BuildError, match=r"is not for FMI 2\.0"):
        build_fmu(components()["PositionController"], tmp_path, platforms=["wasm32-wasip2"])


def test_an_fmu_of_webassembly_alone_says_so_where_it_cannot_run(tmp_path):
    path = build_fmu(components()["PositionController"], tmp_path, fmi=3, platforms=["wasm32-wasip2"])
    assert Instance(Guest(path)).handle is not None
    done = typed("run", path, cwd=tmp_path)
    assert done.returncode == 1
    assert "wasm32-wasip2" in done.stderr


def test_without_the_encoder_the_extra_is_named(tmp_path, monkeypatch):
    def missing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("shaper_fmu.export.native.fmi_ls_wasm.build.version", missing)
    with pytest.raises(BuildError, match=r"pip install 'shaper-fmu\[wasm\]'"):
        build_fmu(components()["PositionController"], tmp_path, fmi=3, platforms=["wasm32-wasip2"])
    assert not list(tmp_path.iterdir())


def test_the_example_of_the_documentation_runs(tmp_path, monkeypatch, capsys):
    """Half a period of 10 rad/s has not passed after 0.1 s: the first impulse of ZV, a half, is out."""
    text = (Path(__file__).parents[2] / "docs" / "webassembly.md").read_text(encoding="utf-8")
    lines = text[text.index("    import zipfile") :].splitlines()
    code = [line.removeprefix("    ") for line in itertools.takewhile(lambda line: not line or line.startswith("    "), lines)]
    (tmp_path / "fmus").mkdir()
    (tmp_path / "fmus" / "InputShaper.fmu").write_bytes(fmu("InputShaper").read_bytes())
    monkeypatch.chdir(tmp_path)
    exec(compile("\n".join(code), "webassembly.md", "exec"), {})
    assert capsys.readouterr().out == "[0.5]\n"


@pytest.mark.parametrize("method", ["set-debug-logging", "get-float64"])
def test_what_would_spoil_a_call_under_way_traps(method):
    """The host calls from within log-message, with a list or for a list, whose memory the call under way needs."""
    one = started("MassSpringDamper")
    arguments = {"set-debug-logging": (True, ["logAll"]), "get-float64": ([1],)}
    function = one.guest.function(one.kind, f"[method]{one.kind}-instance.{method}").func

    def back(store) -> None:
        function(store, one.handle, *arguments[method])

    one.guest.told = back
    with pytest.raises(wasmtime.WasmtimeError, match="unreachable"):
        one.call("get-float64", [9999])

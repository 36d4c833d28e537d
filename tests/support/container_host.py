"""A container's library called directly, and containers of all kinds of FMUs to call (see native_calls.py and native_fuzz.py)."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Callable
from ctypes import (
    byref,
    c_byte,
    c_float,
    c_int8,
    c_int16,
    c_size_t,
    c_uint8,
    c_uint16,
    c_uint32,
    c_uint64,
    c_void_p,
)
from dataclasses import dataclass, replace
from pathlib import Path

import fmpy
from clocked_fmus import clocked_fmu
from containers import container, shaped_oscillator
from faulty_fmus import chain, faulty_fmu
from native_calls import C_TYPES, LOGGER2, LOGGER3, Callbacks2, Host
from native_drivers import unpacked
from native_fuzz import Fuzzer
from native_host import signatures, token_of
from native_model import ALL
from reading_fmus import lag_fmu

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.system import System

_MORE_TYPES = {
    "Float32": c_float,
    "Int8": c_int8,
    "Int16": c_int16,
    "UInt8": c_uint8,
    "UInt16": c_uint16,
    "UInt32": c_uint32,
    "UInt64": c_uint64,
}


def library_of(folder: Path) -> Path:
    """The library for this machine of an unpacked container."""
    (found,) = [path for here in (fmpy.platform, fmpy.platform_tuple) for path in (folder / "binaries" / here).glob("*.so")]
    return found


def loaded(library: Path, fmi: int) -> ctypes.CDLL:
    """A library with the argument types of all functions."""
    found = ctypes.CDLL(str(library))
    for name, (result, arguments) in signatures(fmi).items():
        function = getattr(found, name)
        function.restype, function.argtypes = result, arguments
    return found


class ContainerHost(Host):
    """One instance of a container, and what its logger got."""

    def __init__(self, fmu: Path, events: bool = False, folder: Path | None = None, early: bool = True):
        self.early = early
        self.fmu, self.folder = fmu, folder or unpacked(fmu)
        about = fmpy.read_model_description(str(fmu), validate=False)
        self.fmi, self.exchange = int(str(about.fmiVersion)[0]), False
        self.name, self.events, self.states = str(about.modelName), events and self.fmi == 3, 0
        self.types = C_TYPES[self.fmi] | (_MORE_TYPES if self.fmi == 3 else {})
        self.library, self.token = loaded(library_of(self.folder), self.fmi), token_of(fmu).encode()
        self.log: list[tuple[int, str]] = []
        self.variables = [v for v in about.modelVariables if v.causality != "independent" and v.type in self.types]
        able = about.coSimulation
        assert able
        self.saves, self.serializes = bool(able.canGetAndSetFMUstate), bool(able.canSerializeFMUstate)
        self._logger = LOGGER2(self._log2) if self.fmi == 2 else LOGGER3(self._log3)
        self._functions = Callbacks2(logger=ctypes.cast(self._logger, c_void_p))
        self._update = None
        self.instance = self.instantiate()
        assert self.instance, self.log


def copied(fmu: Path, folder: Path) -> Path:
    """An unpacked copy of a container, to be damaged."""
    return Path(shutil.copytree(unpacked(fmu), folder))


# containers of all kinds


@dataclass(frozen=True)
class Kind:
    """What is inside, by what it is called; `expose` as for containers, `step` inside [s]."""

    system: Callable[[], System]
    expose: tuple[str, ...] = ()
    step: float | None = None


def _mixed() -> System:
    """Of both versions of FMI, with events of its own."""
    system = System("mixed")
    system.add("profile", fmu_path("MotionProfile", 3, platforms=["this"]), distance=1.0)
    system.add("shaper", fmu_path("InputShaper", 2, platforms=["this"]), shaper="zvd", natural_frequency=[10.0])
    system.add("plant", fmu_path("MassSpringDamper", 3, platforms=["this"]), mass=1.0, stiffness=100.0)
    system.connect_raw("profile.position", "shaper.command")
    system.connect_raw("shaper.shaped", "plant.force")
    return system


def _lag(version: int) -> System:
    system = System("lag")
    system.add("first", lag_fmu(version))
    system.add("second", lag_fmu(version))
    system.connect("first.x", "second.u")
    return system


def _clocked() -> System:
    system = System("clocked")
    system.add("clocked", clocked_fmu('intervalVariability="constant" intervalDecimal="0.1"'))
    return system


KINDS = {
    "shaped2": Kind(lambda: shaped_oscillator(2), ("plant.mass", "shaper.shaper")),
    "shaped3": Kind(lambda: shaped_oscillator(3), ("shaper.natural_frequency*", "plant.stiffness")),
    "mixed": Kind(_mixed, ("profile.*",)),
    "stepped": Kind(lambda: shaped_oscillator(3), ("shaper.shaper",), step=0.01),
    "lag2": Kind(lambda: _lag(2)),
    "lag3": Kind(lambda: _lag(3)),
    "faulty2": Kind(lambda: chain(faulty_fmu(2)), ("x.fault", "x.status", "x.fault_time")),
    "faulty3": Kind(lambda: chain(faulty_fmu(3)), ("x.fault", "x.status", "x.fault_time")),
    "clocked": Kind(_clocked),
}


def container_of(kind: str, fmi: int, folder: Path) -> Path:
    """The container of this kind for FMI 2.0 or 3.0; it is made if it is missing."""
    known, path = KINDS[kind], folder / f"{kind}_{fmi}.fmu"
    return path if path.exists() else container(known.system(), path, fmi, known.expose, step=known.step)


# random calls


class ContainerFuzzer(Fuzzer):
    """Random calls of a container: states are those of its own instance alone, and are serialized where all inside can do that."""

    shortest = 1e-300

    def __init__(self, host: ContainerHost, seed: str, foreign: list[int], goes_far: bool):
        super().__init__(host, seed, foreign, foreign[0])
        self.host: ContainerHost = host
        self.goes_far = goes_far

    def save(self) -> None:
        if self.host.saves:
            super().save()
        else:
            self.check(self.state_name("Get"), (byref(c_void_p()),), ALL, False)

    def pack(self) -> None:
        """Serialize a state, and back; or what must not be taken for one."""
        size, stem = c_size_t(), "SerializedFMU" + ("State" if self.host.fmi == 3 else "state")
        serialize = self.state_name("Serialize")
        deserialize = "DeserializeFMUState" if self.host.fmi == 3 else "DeSerializeFMUstate"
        self.check(f"{stem}Size", (None, byref(size)), ALL, False)
        if not self.states:
            return
        state, life, values = self.random.choice(self.states)
        self.check(f"{stem}Size", (state, None), ALL, False)
        if not self.host.serializes:
            self.check(f"{stem}Size", (state, byref(size)), ALL, False)
            return
        assert self.check(f"{stem}Size", (state, byref(size)), ALL)
        data, n = (c_byte * size.value)(), size.value
        foreign = self.random.choice(self.foreign)
        for arguments in [(None, data, n), (state, None, n), (state, data, n - 1), (state, data, 0), (foreign, data, n)]:
            self.check(serialize, arguments, ALL, False)
        assert self.check(serialize, (state, data, n), ALL)
        damaged = (c_byte * n).from_buffer_copy(data)
        damaged[self.random.randrange(n)] ^= 1 << self.random.randrange(7)
        fresh = c_void_p()
        for arguments in [(damaged, n, byref(fresh)), (data, n - 1, byref(fresh)), (data, 0, byref(fresh)), (data, n // 2, byref(fresh)),
                          ((c_byte * (n + 1))(*data), n + 1, byref(fresh)), (None, n, byref(fresh)), (data, n, None)]:  # fmt: skip
            self.check(deserialize, arguments, ALL, False)
        assert not fresh.value
        assert self.check(deserialize, (data, n, byref(fresh)), ALL)
        self.states.append((fresh, replace(life), values))

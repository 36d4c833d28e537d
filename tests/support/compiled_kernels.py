"""A component's kernels in C, compiled by ziglang's clang or by gcc and called on a record, beside plain Python."""

from __future__ import annotations

import ctypes
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from shaper_fmu.component import Component
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.native import backend
from shaper_fmu.export.native.kernels import component_files

RUNTIME = Path(backend.__file__).parent / "kernel.h"
WARNINGS = ("-Wall", "-Wextra", "-pedantic", "-Werror")
ZIG = (sys.executable, "-m", "ziglang", "cc", "-fno-sanitize=all")


def record_dtype(component: type[Component]) -> np.dtype:
    """The record as a C struct: doubles for Real, ints for all other types, arrays in place."""
    kinds = {"d": "f8", "i": "i4"}
    fields = [(v.name, kinds[v.code], () if v.size is None else (v.size,)) for v in component.variables.values()]
    return np.dtype(fields, align=True)


def record_of(instance: Component) -> np.ndarray:
    """The values of a plain component as a record, shape (1,)."""
    record = np.zeros(1, record_dtype(type(instance)))
    for name in instance.variables:
        record[name] = getattr(instance, name)
    return record


def packed_dtype(component: type[Component]) -> np.dtype:
    """The record on 32-bit Linux, where doubles lie at multiples of four bytes."""
    wide = record_dtype(component)
    names = list(wide.names or ())
    kinds = [wide[name] for name in names]
    offsets = np.cumsum([0, *[kind.itemsize for kind in kinds]])
    return np.dtype({"names": names, "formats": kinds, "offsets": offsets[:-1].tolist(), "itemsize": int(offsets[-1])})


def on_32_bits(component: type[Component], records: list[np.ndarray], folder: Path) -> list[tuple[np.ndarray, bool]]:
    """What a 32-bit program makes of each record, and whether it has failed; with the arithmetic of SSE2, static, by ziglang and musl."""
    for name, text in component_files(component).items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = [str(folder / "kernels.c"), str(RUNTIME.parents[3] / "tests" / "support" / "hosts" / "kernels.c")]
    target = ["-target", "x86-linux-musl", "-mcpu=pentium4", "-static", "-std=c99", "-O2", "-ffp-contract=off"]
    program = folder / "kernels32"
    subprocess.run([*ZIG, *target, f"-I{folder}", f"-I{RUNTIME.parent}", *sources, "-lm", "-o", str(program)], check=True)
    packed = packed_dtype(component)
    given = b"".join(record.astype(packed).tobytes() for record in records)
    done = subprocess.run([program], input=given, capture_output=True, check=True).stdout
    whole = np.frombuffer(done, np.dtype([("record", packed), ("failed", "i4")]))
    return [(one["record"].astype(record_dtype(component)).reshape(1), bool(one["failed"])) for one in whole]


class Fault(ctypes.Structure):
    """See kernel.h."""

    _fields_ = [
        ("what", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("where", ctypes.c_char_p),
        ("value", ctypes.c_double),
        ("limit", ctypes.c_double),
    ]


def kernel_library(component: type[Component], compiler: tuple[str, ...] = ZIG, flags: tuple[str, ...] = ("-O2",)) -> Path:
    """A shared library of the kernels alone, compiled without a warning."""
    files = component_files(component)
    key = digest(*files.values(), RUNTIME.read_bytes(), *compiler, *flags, *WARNINGS)

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            standard = "-std=c++11" if compiler[0] == "g++" else "-std=c99"
            options = [
                standard,
                "-ffp-contract=off",
                "-shared",
                "-fPIC",
                "-DNOT_EXPORTED=",
                *WARNINGS,
                *flags,
                f"-I{RUNTIME.parent}",
            ]
            command = [*compiler, *options, str(Path(folder) / "kernels.c"), "-lm", "-o", str(Path(folder) / "kernels.so")]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            return (Path(folder) / "kernels.so").read_bytes()

    return cached("test_kernels", f"{component.__name__}-{key}.so", make)


class Kernels:
    """The kernels of a component in C. A fault is raised as ArithmeticError with what it says."""

    def __init__(self, component: type[Component], compiler: tuple[str, ...] = ZIG, flags: tuple[str, ...] = ("-O2",)):
        self.library = ctypes.CDLL(str(kernel_library(component, compiler, flags)))
        self.library.kernel_step.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_void_p]
        self.library.kernel_start.argtypes = [ctypes.c_void_p, ctypes.c_void_p]

    def start(self, record: np.ndarray) -> int:
        """The status of `start` on a record."""
        fault = Fault()
        return self._checked(self.library.kernel_start(record.ctypes.data, ctypes.byref(fault)), fault)

    def step(self, record: np.ndarray, t: float, h: float) -> int:
        """The status of `step` on a record over [t, t + h]."""
        fault = Fault()
        return self._checked(self.library.kernel_step(record.ctypes.data, t, h, ctypes.byref(fault)), fault)

    def _checked(self, status: int, fault: Fault) -> int:
        if fault.what:
            raise ArithmeticError(
                f"{fault.what.decode()} ({fault.name.decode()}, {fault.where.decode()}, {fault.value:.17g}, {fault.limit:g})"
            )
        return status

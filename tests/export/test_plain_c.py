"""Kernels as plain C for controllers: they compile, and their example prints what the plain Python component computes."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from shaper_fmu.cli.main import app
from shaper_fmu.export.plain_c import write_c
from shaper_fmu.registry import components

every_component = pytest.mark.parametrize("name", components())
COMPILERS = {
    "C": ["gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"],
    "C++": ["g++", "-x", "c++", "-Wall", "-Wextra", "-Werror"],
}


def compiled(folder: Path, name: str, main: str, kind: str = "C") -> Path:
    program = folder / f"{name}_{kind}"
    command = [
        *COMPILERS[kind],
        "-O2",
        "-ffp-contract=off",
        str(folder / main),
        str(folder / f"{name}.c"),
        "-lm",
        "-o",
        str(program),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return program


def printed(name: str) -> list[str]:
    """What the example prints, by plain Python: a hundred steps with the first real input at 1."""
    kind = components()[name]
    m = kind()
    given = [
        v.name
        for v in kind.variables.values()
        if v.causality == "input" and v.kind is float and v.problem(v.scalar_names[0], 1.0) is None
    ]
    taken = [v for v in kind.variables.values() if v.causality == "output" and v.kind is float and v.name != "next_event_time"]
    m.initialize(0.0)
    lines, h = [], kind.default_step_size
    for i in range(100):
        if given:
            m.set(given[0], 1.0)
        m.do_step(i * h, h)
        values = [getattr(m, v.name) if v.size is None else getattr(m, v.name)[0] for v in taken]
        shown = "".join(f", {v.name} = {value:.9g}" for v, value in zip(taken, values, strict=True))
        lines.append(f"t = {(i + 1) * h:g}{shown}")
    return lines


@every_component
def test_the_example_compiles_and_prints_what_python_computes(name, tmp_path):
    write_c(components()[name], tmp_path)
    runs = [
        subprocess.run([compiled(tmp_path, name, f"{name}_example.c", kind)], capture_output=True, text=True, check=True).stdout
        for kind in COMPILERS
    ]
    assert runs[0] == runs[1]
    assert runs[0].splitlines() == printed(name)


MAIN = """\
#include "InputShaper.h"
#include "MassSpringDamper.h"
#include <stdio.h>

int main(void) {{
    InputShaper shaper;
    MassSpringDamper mass;
    Fault fault;
    InputShaper_init(&shaper);
    MassSpringDamper_init(&mass);
    {change}
    int status = InputShaper_start(&shaper, 0.0, &fault);
    if (!status && !fault.what) status = MassSpringDamper_start(&mass, 0.0, &fault);
    if (!status && !fault.what) status = MassSpringDamper_step(&mass, 0.0, 0.1, &fault);
    printf("%d|%s|%s|%g|%s|%d|%d", status, fault.what ? fault.what : "", fault.what ? fault.name : "", fault.value,
           InputShaper_message(status), (int)sizeof shaper, (int)sizeof mass);
    return 0;
}}
"""


@pytest.mark.parametrize(("change", "expected"), [
    ("shaper.shaper = InputShaper_shaper_zvd;", "0||"),
    ("mass.mass = 0.0;", "0|value outside of its domain|mass|0|"),
    ("mass.force = 0.0 / mass.damping - 1e308 * 10.0;", "0|value outside of its domain|force|-inf|"),
    ("shaper.shaper = 99;", "0|value outside of its domain|shaper|99|"),
    ("shaper.damping_ratio[0] = 1.0;", "0|value outside of its domain|damping_ratio|1|"),
    ("shaper.shaper = InputShaper_shaper_custom; shaper.custom_amplitude[0] = 0.25;", "3|||0|the first {custom_impulses} elements"),
])  # fmt: skip
def test_two_kernels_live_in_one_program_and_refuse_what_is_outside_of_a_domain(change, expected, tmp_path):
    for name in ("InputShaper", "MassSpringDamper"):
        write_c(components()[name], tmp_path)
    (tmp_path / "main.c").write_text(MAIN.format(change=change))
    command = ["gcc", "-std=c99", "-w", *[str(tmp_path / f) for f in ("main.c", "InputShaper.c", "MassSpringDamper.c")]]
    subprocess.run([*command, "-lm", "-o", str(tmp_path / "main")], check=True)
    found = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout
    assert found.startswith(expected)
    sizes = [int(word) for word in found.split("|")[-2:]]
    told = [
        re.search(r"is kept: (\d+) bytes", " ".join((tmp_path / f"{n}.h").read_text().split()))
        for n in ("InputShaper", "MassSpringDamper")
    ]
    assert [int(match[1]) for match in told if match] == sizes


def test_the_command_writes_c_instead_of_fmus(tmp_path):
    run = CliRunner().invoke(app, ["build", "PositionController", "--c", str(tmp_path / "out"), "--output", str(tmp_path / "fmus")])
    assert run.exit_code == 0, run.output
    names = {"PositionController.h", "PositionController.c", "PositionController_example.c", "kernel.h"}
    assert {file.name for file in (tmp_path / "out").iterdir()} == names
    assert not (tmp_path / "fmus").exists()

"""Fifty usual mistakes on the command line, and what the message says to do: reviewed one by one.

A message names what is wrong and what would be right: the nearest name, the domain, the form. The work has not begun: exit code 2;
1 where a file's content is wrong. Nothing is written.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from command_line import typed

PLANT = "tune MassSpringDamper.fmu --input force --output position"

MISTAKES = {  # what is typed: what the message says
    "list InputShapr": "there is no component 'InputShapr'. Did you mean 'InputShaper'?",
    "build InputShaper2": "Did you mean 'InputShaper'?",
    "build InputShaper --platform linux": "there is no platform 'linux'. Known: this (the machine here), x86_64-linux,",
    "build InputShaper --fmi 1": "'1' is not one of '2', '3'",
    "build InputShaper --start shape=zv": "no input or parameter 'shape'. Did you mean 'shaper'?",
    "build InputShaper --start shaper=zzv": "'zzv' is not a value of shaper. Did you mean 'zv'?",
    "build InputShaper --start damping_ratio=2": "an array of 4 elements, not 2.0; give a list, or one element: damping_ratio[1]",
    "build InputShaper --start vibration_tolerance=5": "must be",
    "build notes.txt": "Known: ",
    "build empty.py": "no subclass of shaper_fmu.Component with a step function",
    "check text.fmu": "not a readable archive",
    "check nowhere.fmu": "nowhere.fmu: No such file or directory",
    "info nowhere.ssp": "nowhere.ssp: No such file or directory",
    "design zvf -w 5": "Did you mean 'zv'?",
    "design zvd": "--natural-frequency: give at least one, such as -w 5 [rad/s] or -f 0.8 [Hz]",
    "design zvd 5": "'5' is no shaper; only shapers are compared with each other. Numbers follow options: -w 5 is a frequency",
    "design zvd -w 5,14": "'5,14' is not a number: a decimal has a point (5.14); an option that takes several values is repeated for each",
    "design zvd -w 5kHz": "'5kHz' is not a number with a unit that is taken here: Hz, rad/s, or none",
    "design s_curve -w 5": "without max_velocity and max_acceleration there is no shortest duration; give them, or a duration",
    "design zvd -w -5": "-5 is outside its domain: a finite number above 0",
    "design zvd -w 5 -z 1.2": "1.2 is outside its domain: 0 <= zeta < 1",
    "design zvd -w five": "'five' is not a number",
    "design zvd -w 5 --plot a.bmp": "must end with .html, .htm, .png or .svg",
    "design ei -w 5 --tolerance 5": "5 is outside its domain: between 0 and 1",
    "design si --low 6 --high 4": "must be positive, finite and not decrease",
    "design si -w 5": "si needs --low and --high",
    "design fastest -w 5": "the fastest move needs it, or --max-jerk",
    "design fastest -w 5 --max-velocity 0 --max-acceleration 3": "0 is outside its domain: a finite number above 0",
    "design zvd --modes broken.toml": "broken.toml",
    "design zvd --modes nowhere.toml": "nowhere.toml: No such file or directory",
    "design zvd -w 5 --colour red": "No such option: --colour",
    "run nowhere.ssp": "nowhere.ssp: No such file or directory",
    "run MassSpringDamper.fmu --until 2h": "'2h' is not a number with a unit that is taken here: us, ms, min, s, or none",
    "run MassSpringDamper.fmu --solver-tolerance 1e-6s": "is not a number; its unit is that of the help, and not written",
    "check crane": "crane: not a file but a system's folder; its archive is taken: shaper-fmu build crane makes crane.ssp",
    "pack crane": "shaper-fmu build crane makes crane.ssp",
    "tune crane --input a.b --output a.c": "shaper-fmu build crane makes crane.ssp",
    "sweep system.ssp": "system.ssp: a system, not a study of it; shaper-fmu new study system.ssp writes one to begin with",
    "tune MassSpringDamper.fmu": "--input: name the input that gets the commands",
    "tune MassSpringDamper.fmu --input forc --output position": "no input 'forc'. Did you mean 'force'?",
    "tune MassSpringDamper.fmu --input force --output postion": "no variable 'postion'. Did you mean 'position'?",
    "tune MassSpringDamper.fmu --input position --output force": "(it is of causality output). Known: force",
    f"{PLANT} --vary mas=10%": "no parameter or input 'mas'. Did you mean 'mass'?",
    f"{PLANT} --vary mass": "'mass' is not of the form mass=10%",
    f"{PLANT} --vary mass=10": "10 would be 1000 %: did you mean 10%? If not, write 1000%",
    f"{PLANT} --vary mass=ten": "'ten' is not a share; write 5% or 0.05",
    f"{PLANT} --tolerance 0": "outside its domain 0 < tolerance < 1",
    f"{PLANT} --kind zvf": "Did you mean 'zv'?",
    f"{PLANT} --set mass=-1": "mass = -1 kg must be greater than 0 kg",
    f"{PLANT} --for clipper": "'klipper', 'kalico', 'marlin'",
    f"{PLANT} --move 1": "tune a shaper for it (without a move), or name an input in m, rad or deg",
    "tune ringing.csv --output y": "the table has no column 'y'. Known: time, x",
    "tune ringing.csv --vary mass=10%": "a measured response has no parameter 'mass'",
    "sweep nameless.toml": "missing required field `name`",
    "sweep nowhere.toml": "nowhere.toml: No such file or directory",
    "sweep ringing.csv": "must end with .toml",
    "report ringing.csv": "not a sweep's store",
    "report nowhere.sqlite": "nowhere.sqlite: No such file or directory",
    "export nowhere.sqlite --output a.csv": "nowhere.sqlite: No such file or directory",
    "wrap MassSpringDamper.fmu --input forc": "no input 'forc' of real numbers. Did you mean 'force'?",
    "new system --plant MassSpringDamper.fmu --input forc --output position": "Did you mean 'force'?",
    "reproduce pmw": "there is no 'pmw'. Did you mean 'pwm'?",
    "reproduce --output notes.txt": "notes.txt is not a folder",
    "sweeep study.toml": "No such command 'sweeep'. Did you mean 'sweep'?",
    "--verion": "--version",
}
IN_THE_FILE = {  # exit code 1
    "build empty.py", "check text.fmu", "design zvd --modes broken.toml", "sweep nameless.toml", "report ringing.csv",
    f"{PLANT} --set mass=-1", f"{PLANT} --move 1",
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(fmus, tmp_path_factory) -> Path:
    """A folder with a plant, a recording and files that are not what they seem."""
    place = tmp_path_factory.mktemp("desk")
    (place / "MassSpringDamper.fmu").write_bytes((fmus / "MassSpringDamper.fmu").read_bytes())
    (place / "ringing.csv").write_text("time,x\n" + "".join(f"{0.01 * i},{math.cos(0.1 * i)}\n" for i in range(500)))
    (place / "text.fmu").write_text("no archive")
    (place / "system.ssp").write_text("no archive")
    (place / "crane").mkdir()
    (place / "crane" / "SystemStructure.ssd").write_text("<ssd/>")
    (place / "notes.txt").write_text("a list")
    (place / "broken.toml").write_text("x = [")
    (place / "nameless.toml").write_text('system = "crane.ssp"\n')
    (place / "empty.py").write_text("from shaper_fmu import Component\n")
    return place


def written(folder: Path) -> list[Path]:
    """All files, but for the bytecode that Python keeps of a module that it reads."""
    return sorted(path for path in folder.rglob("*") if "__pycache__" not in path.parts)


@pytest.mark.parametrize("line", MISTAKES)
def test_the_message_says_what_to_do(folder, line):
    before = written(folder)
    done = typed(*line.split(), cwd=folder)
    said = " ".join((done.stderr + done.stdout).split())
    assert MISTAKES[line] in said, said
    assert done.returncode == (1 if line in IN_THE_FILE else 2)
    assert "Traceback" not in said
    assert written(folder) == before


def test_there_are_fifty():
    assert len(MISTAKES) >= 50
    assert MISTAKES.keys() >= IN_THE_FILE

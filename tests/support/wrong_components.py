"""Systems that are wrong in components and their FMUs."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable

from right_system import PLANT, SSD, Wrong

from shaper_fmu.archives import read_archive


def _changed_fmu(name: str, change: Callable[[dict[str, bytes]], None]) -> Callable[[dict[str, bytes]], None]:
    def apply(files: dict[str, bytes]) -> None:
        path = f"resources/{name}.fmu"
        inner = read_archive(files[path], path)
        change(inner)
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            for entry, content in inner.items():
                archive.writestr(entry, content)
        files[path] = stream.getvalue()

    return apply


def _for_another_platform(files: dict[str, bytes]) -> None:
    for name in [name for name in files if name.startswith("binaries/")]:
        files[f"binaries/darwin64/{name.rsplit('/', 1)[1]}"] = files.pop(name)


def _no_description(files: dict[str, bytes]) -> None:
    del files["modelDescription.xml"]


def _undefined_unit(files: dict[str, bytes]) -> None:
    text = files["modelDescription.xml"].decode()
    files["modelDescription.xml"] = text.replace('<Real unit="kg" min', '<Real unit="slug" min').encode()


def _co_simulation_alone(files: dict[str, bytes]) -> None:
    text = files["modelDescription.xml"].decode()
    begin = text.index("<ModelExchange")
    end = "</ModelExchange>"
    files["modelDescription.xml"] = (text[:begin] + text[text.index(end, begin) + len(end) :]).encode()


COMPONENTS: dict[str, Wrong] = {
    "no such FMU": Wrong(
        ((SSD, "resources/MassSpringDamper.fmu", "resources/MassSpringDumper.fmu"),),
        (
            (
                SSD,
                "Dumper",
                "component 'plant': 'resources/MassSpringDumper.fmu' is missing in the archive. Did you mean 'resources/MassSpringDamper.fmu'?",
            ),
        ),
    ),
    "an FMU on a server": Wrong(
        ((SSD, "resources/MassSpringDamper.fmu", "http://localhost/MassSpringDamper.fmu"),),
        (
            (
                SSD,
                "http://localhost",
                "component 'plant': source 'http://localhost/MassSpringDamper.fmu' lies outside the archive; only paths in the archive are read",
            ),
        ),
    ),
    "an FMU outside the archive": Wrong(
        ((SSD, "resources/MassSpringDamper.fmu", "../MassSpringDamper.fmu"),),
        (
            (
                SSD,
                "../Mass",
                "component 'plant': source '../MassSpringDamper.fmu' leads out of the archive; a path relative to the description is needed",
            ),
        ),
    ),
    "a Modelica model": Wrong(
        ((SSD, PLANT, PLANT.replace(" source", ' type="text/x-modelica" source')),),
        (
            (
                SSD,
                "x-modelica",
                "component 'plant' is of type 'text/x-modelica'; FMUs (application/x-fmu-sharedlibrary) and systems can be run",
            ),
        ),
    ),
    "an FMU for another platform": Wrong(
        (),
        ((SSD, PLANT, "component 'plant': MassSpringDamper.fmu has no library for this machine (linux64); it has darwin64"),),
        change=_changed_fmu("MassSpringDamper", _for_another_platform),
    ),
    "a broken FMU": Wrong(
        (),
        ((SSD, PLANT, "component 'plant': MassSpringDamper.fmu: no modelDescription.xml, so this is not an FMU"),),
        change=_changed_fmu("MassSpringDamper", _no_description),
    ),
    "an FMU with an undefined unit": Wrong(
        (),
        (
            (
                SSD,
                PLANT,
                'component \'plant\': MassSpringDamper.fmu: modelDescription.xml: The unit "slug" of variable "mass" (line 58) is not defined.',
            ),
            (SSD, 'unit="t"', "parameter mass -> plant.mass: unit t does not convert to slug"),
        ),
        change=_changed_fmu("MassSpringDamper", _undefined_unit),
    ),
    "model exchange asked of an FMU for co-simulation alone": Wrong(
        ((SSD, PLANT, PLANT.replace(">", ' implementation="ModelExchange">')),),
        (
            (
                SSD,
                'implementation="ModelExchange"',
                "component 'plant': MassSpringDamper.fmu offers co-simulation only, not model exchange",
            ),
        ),
        change=_changed_fmu("MassSpringDamper", _co_simulation_alone),
    ),
    "a connector that is not a variable": Wrong(
        ((SSD, '<ssd:Connector name="acceleration"', '<ssd:Connector name="accelerating"'),),
        (
            (
                SSD,
                "accelerating",
                "connector plant.accelerating is not a variable of MassSpringDamper.fmu. Did you mean 'acceleration'?",
            ),
        ),
    ),
    "a connector of another causality": Wrong(
        ((SSD, '<ssd:Connector name="acceleration" kind="output">', '<ssd:Connector name="acceleration" kind="input">'),),
        (
            (
                SSD,
                '"acceleration" kind="input"',
                "connector plant.acceleration is of kind input, but output in MassSpringDamper.fmu",
            ),
        ),
    ),
    "a connector of another type": Wrong(
        ((SSD, "<ssc:Boolean/></ssd:Connector>", "<ssc:Integer/></ssd:Connector>"),),
        ((SSD, '"moving"', "connector command.profile.moving is of type Integer, but Boolean in MotionProfile.fmu"),),
    ),
    "a connector in another unit": Wrong(
        ((SSD, '<ssc:Real unit="m/s2"/>', '<ssc:Real unit="N"/>'),),
        ((SSD, '"acceleration"', "connector plant.acceleration is in N, which does not convert to m/s2 of MassSpringDamper.fmu"),),
    ),
    "an item that the FMU has not": Wrong(
        ((SSD, '<ssc:Item name="s_curve" value="7"/>', '<ssc:Item name="scurve" value="7"/>'),),
        (
            (
                SSD,
                '<ssd:Connector name="profile" kind',
                "connector command.profile.profile: MotionProfile.fmu has no item 'scurve'. Did you mean 's_curve'?",
            ),
        ),
    ),
}

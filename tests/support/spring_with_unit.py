"""The FMU MassSpringDamper, whose input is said to be in another unit."""

from __future__ import annotations

import zipfile
from pathlib import Path

from shaper_fmu.export.build import fmu_path


def spring_with_unit(folder: Path, unit: str, base: str = "") -> Path:
    """Spring.fmu, whose `force` has a unit that its description defines for other variables, or one with this base; "" for none."""
    source, target = fmu_path("MassSpringDamper", platforms=["this"]), folder / "Spring.fmu"
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                lines = data.decode().split("\n")
                first = next(k for k, line in enumerate(lines) if 'name="force"' in line)
                place = next(k for k in range(first, first + 4) if 'unit="N"' in lines[k])
                lines[place] = lines[place].replace(' unit="N"', f' unit="{unit}"' if unit else "")
                text = "\n".join(lines)
                if base:
                    text = text.replace("</UnitDefinitions>", f'<Unit name="{unit}"><BaseUnit {base}/></Unit></UnitDefinitions>')
                data = text.encode()
            new.writestr(name, data)
    return target

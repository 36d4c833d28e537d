"""Examples of the four papers, as states of the page (see static/state.js); the numbers are those of `shaper_fmu.reproduce`."""

from __future__ import annotations

import math
from typing import Any

from shaper_fmu.live.plants import Plant
from shaper_fmu.reproduce.partial_modes.runs import PRINTED
from shaper_fmu.reproduce.pwm.runs import DAMPING_RATIO as PWM_DAMPING
from shaper_fmu.reproduce.pwm.runs import HALF_PERIOD, SHORT
from shaper_fmu.reproduce.pwm.runs import NATURAL_FREQUENCY as PWM_FREQUENCY
from shaper_fmu.reproduce.s_curve.runs import DISTANCE as BEAM_DISTANCE
from shaper_fmu.reproduce.two_part.runs import COMMANDS, DAMPING_RATIO, DISTANCE, DURATION, NATURAL_FREQUENCY

PWM = "Taskin, Kilic, Kapucu 2019: pulses"
S_CURVE = "Ozokutan et al. 2025: S-curve"
TWO_PART = "Kilic, Kapucu 2011: two parts"
PARTIAL = "Jung 2011: three masses"
SHORTEST_S_CURVE = 0.8
"""Of the paper's durations, in periods of the beam's first mode."""


def presets(plants: dict[str, Plant]) -> list[dict[str, Any]]:
    """Title, what to look at, and the state, which names only what differs from the plant's start state."""
    return [
        *(
            _preset(f"{PWM}, {words}", note, plants["MassSpringDamper"], PWM_FREQUENCY, PWM_DAMPING, **more)
            for words, note, more in (
                (
                    "0.1374 s",
                    "An on/off command of the carrier design: the pulses, not a shaper, leave little vibration; with frequency "
                    "ratio 12 less than 5 %, with 11 more.",
                    {"command": "pulses:carrier", "duration": HALF_PERIOD, "carrier": 12.0, "shaper": "none"},
                ),
                (
                    "0.1222 s",
                    "The same with a shorter travel time needs a higher frequency ratio: 13.",
                    {"command": "pulses:carrier", "duration": SHORT, "carrier": 13.0, "shaper": "none"},
                ),
                ("ZV", "The ZV shaper that the paper's pulses approximate: jumps at 0 and 0.1374 s.", {"shaper": "zv"}),
            )
        ),
        *(
            _beam(plants["FlexibleBeam"], kind, words)
            for kind, words in (
                ("s_curve", "S-curve, 0.8 periods: nothing is left in the first mode."),
                ("polynomial_345", "3-4-5 polynomial, 0.8 periods: 62 % of a step's vibration is left in the first mode."),
            )
        ),
        *(
            _preset(
                f"{TWO_PART}, {name}",
                f"The paper's {name} command on an oscillator of its pendulum's frequency; change the plant's stiffness to see how "
                "robust it is.",
                plants["MassSpringDamper"], NATURAL_FREQUENCY, DAMPING_RATIO,
                command=kind, duration=DURATION, size=DISTANCE, shaper="none",
            )
            for name, kind in COMMANDS.items()
        ),
        *(_three_masses(plants["ThreeMassChain"], kept) for kept in ((0, 1), (0,), (1,))),
    ]  # fmt: skip


def _preset(title: str, note: str, plant: Plant, frequency: float, damping: float, **more: Any) -> dict[str, Any]:
    """On a mass of 1 kg with this mode."""
    stiffness = frequency * frequency
    values = {"stiffness": stiffness, "damping": 2.0 * damping * frequency, "mass": 1.0}
    state = {"plant": "MassSpringDamper", "parameters": [values[slider.name] for slider in plant.sliders]}
    return {"title": title, "note": note, "state": {**state, "frequency": [frequency], "damping": [damping], **more}}


def _beam(plant: Plant, command: str, note: str) -> dict[str, Any]:
    beam = plant.component()
    beam.initialize()
    frequency = float(beam.natural_frequency[0])  # pyright: ignore[reportAttributeAccessIssue]
    state = {
        "plant": "FlexibleBeam", "command": command, "size": BEAM_DISTANCE,
        "duration": SHORTEST_S_CURVE * 2.0 * math.pi / frequency, "shaper": "none", "frequency": [frequency], "damping": [0.0],
    }  # fmt: skip
    return {"title": f"{S_CURVE}, {command}", "note": note, "state": state}


def _three_masses(plant: Plant, kept: tuple[int, ...]) -> dict[str, Any]:
    words = " and ".join(str(k + 1) for k in kept)
    state = {
        "plant": "ThreeMassChain", "shaper": "zvd",
        "frequency": [PRINTED[k][0] for k in kept], "damping": [PRINTED[k][1] for k in kept],
    }  # fmt: skip
    note = f"ZVD for mode {words} of the paper's eq. (11), on three masses under control, the defaults of the chain's FMU."
    return {"title": f"{PARTIAL}, mode {words}", "note": note, "state": state}

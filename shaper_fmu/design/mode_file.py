"""Reads the modes of a step response from a TOML or JSON file; unknown fields are errors.

outputs = ["trolley", "load"]       # names, optional
final = [1.0, 1.0]                  # the values that the outputs settle at after a unit step

[[modes]]
natural_frequency = 2.35            # undamped, rad/s
damping_ratio = 0.12
amplitude = [0.5, 1.1]              # of each output: amplitude exp(-zeta w t) cos(w sqrt(1 - zeta^2) t + phase)
phase = [3.1, 3.3]                  # rad, optional

[[modes]]
natural_frequency = 9.6
damping_ratio = 0.29
residue = [[-0.03, 0.01], [0.0, 0.002]]   # or [real, imaginary] of amplitude exp(j phase)

[[modes]]
decay_rate = 4.0                    # 1/s: amplitude exp(-decay_rate t), a pole that cannot swing
amplitude = [-0.2, 0.1]
"""

from __future__ import annotations

import cmath
import math
from pathlib import Path

import msgspec

from shaper_fmu.design.modal_responses import ModalResponse, modal_response
from shaper_fmu.errors import ArgumentError, ComponentError


class _Mode(msgspec.Struct, forbid_unknown_fields=True):
    natural_frequency: float | None = None
    damping_ratio: float | None = None
    decay_rate: float | None = None
    amplitude: list[float] | None = None
    phase: list[float] | None = None
    residue: list[tuple[float, float]] | None = None

    def pole(self) -> complex:
        if self.decay_rate is not None:
            if self.natural_frequency is not None or self.damping_ratio is not None or self.phase is not None:
                raise ArgumentError("decay_rate goes with an amplitude alone")
            return complex(-self.decay_rate)
        if self.natural_frequency is None or self.damping_ratio is None:
            raise ArgumentError("give natural_frequency and damping_ratio, or decay_rate")
        if not (0.0 < self.natural_frequency < math.inf and 0.0 < self.damping_ratio < 1.0):
            raise ArgumentError(
                f"natural_frequency = {self.natural_frequency:g} rad/s and damping_ratio = {self.damping_ratio:g} are outside "
                "their domains > 0 and 0 < zeta < 1 (of an overdamped mode give the two decay rates)"
            )
        w, zeta = self.natural_frequency, self.damping_ratio
        return complex(-zeta * w, w * math.sqrt(1.0 - zeta * zeta))

    def residues(self, outputs: int) -> list[complex]:
        if (self.amplitude is None) == (self.residue is None):
            raise ArgumentError("give either amplitude or residue")
        if self.residue is not None:
            if self.phase is not None:
                raise ArgumentError("phase goes with amplitude, not with residue")
            found = [complex(real, imaginary) for real, imaginary in self.residue]
            if self.decay_rate is not None and any(r.imag for r in found):
                raise ArgumentError("the residues of a decay_rate are real")
        else:
            amplitude = self.amplitude or []
            phase = self.phase if self.phase is not None else [0.0] * len(amplitude)
            if len(phase) != len(amplitude):
                raise ArgumentError(f"{len(phase)} phases for {len(amplitude)} amplitudes")
            found = [cmath.rect(1.0, angle) * size for size, angle in zip(amplitude, phase, strict=True)]
        if len(found) != outputs:
            raise ArgumentError(f"{len(found)} amplitudes or residues for {outputs} outputs")
        return found


class _File(msgspec.Struct, forbid_unknown_fields=True):
    final: list[float]
    modes: list[_Mode]
    outputs: list[str] | None = None


def read_modes(path: Path | str) -> ModalResponse:
    """The response in a file; JSON by the file's ending, otherwise TOML. Raises ArgumentError with the fault and its place."""
    path = Path(path)
    decode = msgspec.json.decode if path.suffix.lower() == ".json" else msgspec.toml.decode
    try:
        found = decode(path.read_bytes(), type=_File)
    except OSError as error:
        raise ArgumentError(f"{path}: {error.strerror or error}") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ArgumentError(f"{path}: {error}") from None
    if not found.modes:
        raise ArgumentError(f"{path}: there is no mode")
    poles, residues = [], []
    for number, mode in enumerate(found.modes, 1):
        try:
            poles.append(mode.pole())
            residues.append(mode.residues(len(found.final)))
        except ComponentError as error:
            raise ArgumentError(f"{path}: mode {number}: {error}") from None
    try:
        return modal_response(poles, list(zip(*residues, strict=True)), found.final, found.outputs)
    except ComponentError as error:
        raise ArgumentError(f"{path}: {error}") from None

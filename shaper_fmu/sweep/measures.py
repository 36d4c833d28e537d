"""The metrics that a study file can name, and the master's metrics that they stand for."""

from __future__ import annotations

import msgspec

from shaper_fmu.master import metrics as of


class _Measure(msgspec.Struct, forbid_unknown_fields=True, tag_field="kind"):
    """Base: of the variable `output`, "instance.variable"."""

    output: str

    def metric(self) -> of.Metric:
        """The master's metric."""
        raise NotImplementedError


class Final(_Measure, tag="final"):
    """Value at the end."""

    def metric(self) -> of.Metric:
        return of.Final(self.output)


class Peak(_Measure, tag="peak"):
    """Largest magnitude of `output` over the run."""

    def metric(self) -> of.Metric:
        return of.Peak(self.output)


class Overshoot(_Measure, tag="overshoot"):
    """How far the output goes beyond its final value, as a share of its way."""

    def metric(self) -> of.Metric:
        return of.Overshoot(self.output)


class Effort(_Measure, tag="effort"):
    """Root mean square."""

    def metric(self) -> of.Metric:
        return of.Effort(self.output)


class Residual(_Measure, tag="residual"):
    """Residual amplitude of `output` after the last change of `command`: half the peak-to-peak value."""

    command: str

    def metric(self) -> of.Metric:
        return of.Residual(self.output, self.command)


class Envelope(_Measure, tag="envelope"):
    """Residual vibration by its envelope, hypot(x - rest, v / w), after the last change of `command`."""

    command: str
    rate: str
    natural_frequency: float
    rest: float = 0.0

    def metric(self) -> of.Metric:
        return of.Envelope(self.output, self.command, self.rate, self.natural_frequency, self.rest)


class SettlingTime(_Measure, tag="settling_time"):
    """Time after which the output stays within `tolerance` of `target`; inf if it does not."""

    target: float
    tolerance: float

    def metric(self) -> of.Metric:
        return of.SettlingTime(self.output, self.target, self.tolerance)


Measure = Final | Peak | Overshoot | Effort | Residual | Envelope | SettlingTime

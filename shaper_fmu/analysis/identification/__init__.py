"""Modes from free responses: poles, residues and their uncertainties, by a subspace method and maximum likelihood."""

from shaper_fmu.analysis.identification.findings import CONTRADICTING, noise_of
from shaper_fmu.analysis.identification.identify import identify, unexplained
from shaper_fmu.analysis.identification.record import FreeResponse, IdentificationError, free_response
from shaper_fmu.analysis.identification.result import Finding, Identification, Mode, OtherPole

__all__ = [
    "CONTRADICTING",
    "Finding",
    "FreeResponse",
    "Identification",
    "IdentificationError",
    "Mode",
    "OtherPole",
    "free_response",
    "identify",
    "noise_of",
    "unexplained",
]

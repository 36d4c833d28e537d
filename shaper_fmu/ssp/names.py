"""Names of the SSP standard: namespaces, file types, and the kinds and types that its versions know."""

from __future__ import annotations

DESCRIPTION = "SystemStructure.ssd"
"""The default variant of an archive; others are further .ssd files beside it."""

SETS = "parameter_sets/"
"""Folder of an archive with parameter sets for the whole system, which are applied on demand."""

PREFIXES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "ssm": "http://ssp-standard.org/SSP1/SystemStructureParameterMapping",
    "ssb": "http://ssp-standard.org/SSP1/SystemStructureSignalDictionary",
}
"""Versions 1.0 and 2.0 share these. Some readers (libcosim, ecos) want just these prefixes, so they are always written."""

SSD, SSC, SSV, SSM, SSB = (f"{{{uri}}}" for uri in PREFIXES.values())

OSP_URI = "http://opensimulationplatform.com/SSP/OSPAnnotations"
OSP = f"{{{OSP_URI}}}"
OMS_URI = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"
USUAL_PREFIXES = {**PREFIXES, "osp": OSP_URI, "oms": OMS_URI}
"""What prefixes mean that a file does not declare; some of OSP's and OMSimulator's do not declare theirs."""

FMU_TYPE = "application/x-fmu-sharedlibrary"
SSD_TYPE = "application/x-ssp-definition"
SSP_TYPE = "application/x-ssp-package"
SET_TYPE = "application/x-ssp-parameter-set"
MAPPING_TYPE = "application/x-ssp-parameter-mapping"
DICTIONARY_TYPE = "application/x-ssp-signal-dictionary"

VERSIONS = ("1.0", "2.0")

REAL_TYPES = ("Real", "Float64", "Float32")
INTEGER_BITS = {"Integer": (True, 32)} | {f"{sign}Int{bits}": (not sign, bits) for bits in (8, 16, 32, 64) for sign in ("", "U")}
"""Integer types: whether they are signed, and their size."""
TYPES_1 = ("Real", "Integer", "Boolean", "String", "Enumeration", "Binary")
TYPES_2 = (*REAL_TYPES, *INTEGER_BITS, "Boolean", "String", "Enumeration", "Binary", "Clock")

KINDS_1 = ("input", "output", "parameter", "calculatedParameter", "inout")
KINDS_2 = (*KINDS_1, "structuralParameter", "constant", "local", "unspecified")

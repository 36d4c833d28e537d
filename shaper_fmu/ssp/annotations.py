"""Settings for a run in other tools' annotations: OSP (libcosim) and OMSimulator.

The type of an annotation, and the namespaces in it, identify its tool; other tools have elements of the same names.

- OSP: Algorithm / FixedStepAlgorithm, baseStepSize [s]. All components step, then all values go over: our "parallel".
- OMSimulator: SimulationInformation / FixedStepMaster "oms-ma", stepSize [s]. Values go over in the order in which they depend
  on each other: our "jacobi". Of VariableStepMaster "oms-mav" the largest step is taken.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from lxml import etree

from shaper_fmu.errors import ModelError
from shaper_fmu.master.algorithms import Algorithm
from shaper_fmu.ssp.document_parts import Annotation
from shaper_fmu.ssp.names import OMS_URI, OSP_URI, PREFIXES

OSP_TYPE = "com.opensimulationplatform"
OMS_TYPE = "org.openmodelica"
_OMS_NAMESPACES = (OMS_URI, "http://openmodelica.org/oms", None)
"""OMSimulator's own; what Vico declares where it writes for OMSimulator; and none, as in OMSimulator's older files."""


@dataclass(frozen=True)
class RunSettings:
    """A step size [s] and an algorithm, with the name of the tool whose annotation contains them."""

    tool: str
    step_size: float
    algorithm: Algorithm


def run_settings(annotations: Iterable[str]) -> list[RunSettings]:
    """The settings in annotations, given as XML text; OMSimulator's first, as they define more. Raises ModelError."""
    found = []
    for text in annotations:
        annotation = etree.fromstring(text)
        kind = annotation.get("type")
        for node in annotation.iter(etree.Element):
            name = etree.QName(node)
            if kind == OSP_TYPE and name.localname == "FixedStepAlgorithm" and name.namespace == OSP_URI:
                found.append(RunSettings("OSP", _step(node, "baseStepSize"), "parallel"))
            elif kind == OMS_TYPE and name.localname in _MASTERS and name.namespace in _OMS_NAMESPACES:
                found.append(RunSettings("OMSimulator", _step(node, _MASTERS[name.localname]), "jacobi"))
    return sorted(found, key=lambda settings: settings.tool)


_MASTERS = {"FixedStepMaster": "stepSize", "VariableStepMaster": "maximumStepSize"}


def _step(node: etree._Element, key: str) -> float:
    text = node.get(key)
    try:
        value = float(text) if text is not None else math.nan
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise ModelError([f"annotation {etree.QName(node).localname}: {key} = {text!r} is not a number greater than 0"])
    return value


def osp_and_oms(step_size: float, algorithm: Algorithm) -> tuple[list[Annotation], list[Annotation]]:
    """Annotations for a step size [s]: OSP's for the default experiment, and OMSimulator's for the root system.

    OMSimulator's master is "jacobi", so for another algorithm there is OSP's alone.
    """
    inner = f'<osp:Algorithm xmlns:osp="{OSP_URI}"><osp:FixedStepAlgorithm baseStepSize="{step_size!r}"/></osp:Algorithm>'
    osp = [_annotation(OSP_TYPE, inner)]
    master = f'<oms:FixedStepMaster description="oms-ma" stepSize="{step_size!r}"/>'
    inner = (
        f'<oms:Annotations xmlns:oms="{OMS_URI}"><oms:SimulationInformation>{master}</oms:SimulationInformation></oms:Annotations>'
    )
    return osp, [_annotation(OMS_TYPE, inner)] if algorithm == "jacobi" else []


def _annotation(kind: str, inner: str) -> Annotation:
    return Annotation(type=kind, xml=f'<ssc:Annotation xmlns:ssc="{PREFIXES["ssc"]}" type="{kind}">{inner}</ssc:Annotation>')

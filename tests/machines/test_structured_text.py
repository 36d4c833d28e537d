"""The shaper as structured text, run by a reader of its own, against the InputShaper's FMU."""

import math
import zlib
from typing import Any

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.simulation import instantiate_fmu
from structured_text import FunctionBlock

from shaper_fmu.design import specified_insensitivity
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ArgumentError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.export.start_values import with_start_values
from shaper_fmu.machines.structured_text import structured_text
from shaper_fmu.registry import find_component

SEQUENCES = {
    "zv": shaper("zv", 9.3, 0.03),
    "zvd": shaper("zvd", 9.3, 0.0),
    "um_zv": shaper("um_zv", 4.0, 0.02),
    "si": specified_insensitivity(8.0, 11.0, 0.05),
    "two modes": shaper("zv", 9.3, 0.03).convolved(shaper("ei", 23.0, 0.01)),
}
CYCLES = (0.001, 0.004, 0.01, 0.037)


def block(sequence, cycle):
    return FunctionBlock(structured_text(sequence, ["made", "for a test"], cycle))


class Shaper:
    """An InputShaper's FMU, a step a cycle, by fmpy."""

    def __init__(self, sequence, folder, initial):
        values = {
            "shaper": "custom", "custom_impulses": len(sequence.delays), "initial_command": initial,
            "custom_amplitude": list(sequence.amplitudes), "custom_delay": list(sequence.delays),
        }  # fmt: skip
        path = fmu_path(
            with_start_values(find_component("InputShaper"), values, f"Shaper{zlib.crc32(str(values).encode())}"),
            platforms=["this"],
        )
        description = read_model_description(path)
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.fmu: Any = instantiate_fmu(extract(path, folder), description, "CoSimulation")
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.setReal([self.references["command"]], [initial])
        self.fmu.exitInitializationMode()

    def means(self, commands, cycle):
        found = []
        for i, command in enumerate(commands):
            self.fmu.setReal([self.references["command"]], [command])
            self.fmu.doStep(i * cycle, cycle)
            found.append(self.fmu.getReal([self.references["shaped_mean"]])[0])
        self.fmu.terminate()
        self.fmu.freeInstance()
        return found


def random_commands(rng, count):
    """Steps, ramps, rests and noise, with a rest at the end."""
    commands = np.zeros(count)
    at = 0
    while at < count:
        length = int(rng.integers(1, 60))
        kind = rng.integers(4)
        start = commands[at - 1] if at else 0.0
        piece = {
            0: np.full(length, rng.normal()),
            1: start + rng.normal() * np.arange(length) / length,
            2: np.full(length, start),
            3: rng.normal(size=length),
        }[int(kind)]
        commands[at : at + length] = piece[: count - at]
        at += length
    commands[-count // 4 :] = commands[-count // 4]
    return commands


@pytest.mark.parametrize("count", [8, pytest.param(200, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("name", SEQUENCES)
def test_a_thousand_random_commands_are_shaped_as_by_the_fmu(name, count, tmp_path):
    sequence, rng = SEQUENCES[name], np.random.default_rng(sorted(SEQUENCES).index(name))
    for i in range(count // len(CYCLES)):
        for cycle in CYCLES:
            commands = random_commands(rng, 4 * (math.ceil(sequence.duration / cycle) + 10) if cycle > 0.02 else 150)
            commands[0] = 0.0
            if i % 10:  # a sum over the definition, which is quicker than an FMU and checked against it at every tenth
                expected = by_definition(sequence, commands, cycle)
            else:
                expected = Shaper(sequence, tmp_path / f"{i}_{cycle}", 0.0).means(commands, cycle)
                np.testing.assert_allclose(by_definition(sequence, commands, cycle), expected, rtol=0, atol=1e-11)
            of_plc = block(sequence, cycle)
            shaped = [of_plc(command=command, cycle=cycle)["shaped"] for command in commands]
            np.testing.assert_allclose(shaped, expected, rtol=0, atol=1e-11)


def by_definition(sequence, commands, cycle):
    """Mean over each cycle of sum A_i u(t - d_i), u held over cycles: differences of the integral of u, which is linear between."""
    edges = np.arange(len(commands) + 1) * cycle
    integral = np.concatenate([[0.0], np.cumsum(commands) * cycle])

    def area(t):
        return np.where(t <= 0.0, commands[0] * np.minimum(t, 0.0), np.interp(t, edges, integral))

    parts = [a * (area(edges[1:] - d) - area(edges[:-1] - d)) for a, d in zip(sequence.amplitudes, sequence.delays, strict=True)]
    return np.sum(parts, axis=0) / cycle


def test_a_command_at_rest_is_passed_on_exactly_and_settled_says_so():
    sequence, cycle = SEQUENCES["two modes"], 0.004
    of_plc = block(sequence, cycle)
    assert of_plc(command=0.3, cycle=cycle)["shaped"] == 0.3
    assert of_plc.values["settled"]
    seen = [dict(of_plc(command=0.1, cycle=cycle)) for _ in range(2 * math.ceil(sequence.duration / cycle))]
    settled = [one["settled"] for one in seen]
    first = settled.index(True)
    assert all(settled[first:])
    assert first == math.floor(sequence.duration / cycle) + 1
    assert all(one["shaped"] == 0.1 for one in seen[first:])
    assert seen[first - 1]["shaped"] != 0.1


@pytest.mark.parametrize("cycle", [0.0, -0.01, 0.0009, math.nan])
def test_a_cycle_that_cannot_be_served_is_a_fault_and_the_command_passes(cycle):
    of_plc = block(SEQUENCES["zvd"], 0.001)
    for command in (0.0, 1.0, 0.5):
        seen = of_plc(command=command, cycle=cycle)
        assert seen["fault"]
        assert seen["shaped"] == command


@pytest.mark.parametrize("factor", [1.0, 1.0 + 1e-12, 1.3, 50.0, 1e6])
def test_longer_cycles_are_served(factor):
    sequence = SEQUENCES["zvd"]
    of_plc = block(sequence, 0.001)
    commands = [0.0, 1.0, 0.5, 0.5, 0.2, *[0.7] * 20]
    shaped = [of_plc(command=c, cycle=0.001 * factor)["shaped"] for c in commands]
    assert not of_plc.values["fault"]
    np.testing.assert_allclose(shaped, by_definition(sequence, np.array(commands), 0.001 * factor), rtol=0, atol=1e-12)


def test_a_cycle_that_keeps_too_many_commands_is_refused_with_the_shortest_one():
    with pytest.raises(ArgumentError, match=r"keeps 675614 commands.*at most every 3.38e-05 s"):
        structured_text(SEQUENCES["zvd"], [], 1e-6)
    with pytest.raises(ArgumentError, match=r"at most every 3.39e-05 s"):  # 3.3833e-05 s, which may not be rounded down
        structured_text(shaper("zvd", 9.287, 0.0), [], 1e-6)
    assert structured_text(shaper("zvd", 9.287, 0.0), [], 3.39e-05)
    shortest = SEQUENCES["zvd"].duration / (20000 - 3.5)
    assert len(block(SEQUENCES["zvd"], shortest).values["history"]) <= 20000


def test_words_of_the_head_cannot_end_the_comment():
    text = structured_text(SEQUENCES["zv"], ["a name with *) in it"], 0.01)
    assert text.startswith("(* a name with * ) in it *)\nFUNCTION_BLOCK")


def test_words_of_the_head_begin_no_comment_in_the_comment():
    """Comments may be nested since the third edition of IEC 61131-3: such a one would swallow the block."""
    assert structured_text(SEQUENCES["zv"], ["a (* b", "(*)"], 0.01).startswith("(* a ( * b *)\n(* ( * ) *)\nFUNCTION_BLOCK")

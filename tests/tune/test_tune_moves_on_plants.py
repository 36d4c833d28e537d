"""`tune` with a move: profiles and shapers compared, and the plant makes the move."""

from __future__ import annotations

import itertools
import json
import math

import numpy as np
import pytest
from command_line import typed
from scipy.integrate import solve_ivp
from spring_with_unit import spring_with_unit

from shaper_fmu import fmu_path, requirements_for, tune_plant
from shaper_fmu.errors import ModelError
from shaper_fmu.registry import find_component
from shaper_fmu.report import write_tuning
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.tune import Move

MOVE = Move(0.5, max_velocity=1.0, max_acceleration=3.0)
INPUTS = {"m": "position", "m/s": "velocity", "m/s2": "acceleration"}


ZETA = 0.001
"""So little that half a peak-to-peak value is the amplitude."""


def of_spring():
    mass, stiffness = (find_component("MassSpringDamper").variables[name].starts[0] for name in ("mass", "stiffness"))
    return mass, math.sqrt(stiffness / mass), {"damping": 2.0 * ZETA * math.sqrt(stiffness * mass)}


def swing_after(candidate, order, w, mass):
    """Amplitude of the spring at the end of the move, by DOP853 from the profile's own functions, piece by piece."""
    law, sequence = candidate.profile, candidate.sequence

    def force(t):
        motion = (law.position, law.velocity, law.acceleration)[order]
        return sum(a * float(motion(t - d)) for a, d in zip(sequence.amplitudes, sequence.delays, strict=True))

    edges = sorted({0.0, *(b + d for b in np.ravel(law.pieces) for d in sequence.delays)})
    state = np.zeros(2)
    for begin, end in itertools.pairwise(edges):
        inside = lambda t, a=begin, b=end: a + (b - a) * (1e-9 + (1.0 - 2e-9) * (t - a) / (b - a))  # noqa: E731
        found = solve_ivp(
            lambda t, y, inside=inside: [y[1], force(inside(t)) / mass - 2 * ZETA * w * y[1] - w * w * y[0]],
            (begin, end), state, method="DOP853", rtol=1e-11, atol=1e-13,
        )  # fmt: skip
        state = found.y[:, -1]
    rest = law.distance / (mass * w * w) if order == 0 else 0.0
    return math.hypot(state[0] - rest, state[1] / w)


@pytest.mark.parametrize("unit", INPUTS)
@pytest.mark.parametrize("kinds", [None, ("zvd",)])
def test_a_move_of_a_position_a_speed_and_an_acceleration(unit, kinds, tmp_path):
    """The share is that of the swing which a step of the position over the same distance leaves, in closed form."""
    order, (mass, w, damping) = list(INPUTS).index(unit), of_spring()
    plant, requirements = spring_with_unit(tmp_path, unit), requirements_for({}, move=MOVE, kinds=kinds)
    found = tune_plant(plant, "force", ["position"], requirements=requirements, start_values=damping)
    assert found.verdict == "tuned", found.summary
    candidate = found.candidate
    assert candidate is not None
    assert candidate.profile is not None
    assert candidate.profile.kind.name == ("trapezoid" if kinds else "fastest")
    seen = found.verification
    assert seen is not None
    # w^order times the amplitude after a step of the input: the step, its derivative, its second derivative
    step = MOVE.distance / (mass * w * w)
    assert seen.nominal.before[0] == pytest.approx(step * w**order, rel=0.015)  # by steps of a 16th of the abrupt move
    left = swing_after(candidate, order, w, mass)
    assert seen.nominal.after[0] == pytest.approx(left, rel=0.05, abs=1e-4 * step * w**order)
    told = candidate.profile.duration + candidate.sequence.duration
    assert f"the move takes {told:.4g} s" in found.summary
    arrived = float(found.summary.split("within the tolerance ")[1].split(" s")[0])
    assert arrived <= told + seen.step
    write_tuning(found, tmp_path / "tuned", report=False)
    system = load_ssp(tmp_path / "tuned" / "shaped_plant.ssp").system
    assert system.connections[("shaper", "command") if kinds else ("plant", "force")] == ("profile", INPUTS[unit])
    assert (tmp_path / "tuned" / "InputShaper_Spring.fmu").exists() == bool(kinds)
    results = load_ssp(tmp_path / "tuned" / "shaped_plant.ssp").simulate(told + 1.0, 0.001, record=["plant.position"])
    after = results["plant.position"][results.time >= told]
    assert 0.5 * np.ptp(after) <= 1.05 * seen.nominal.after[0] + 1e-3 * step * w**order


@pytest.mark.parametrize(("unit", "base"), [("mm", 'm="1" factor="0.001"'), ("rad", 'rad="1"'), ("deg", 'rad="1" factor="0.0174"')])
@pytest.mark.parametrize("kinds", [None, ("zvd",)])
def test_distances_count_in_the_inputs_own_unit(unit, base, kinds, tmp_path):
    """0.5 of it is a force of 0.5, with and without a shaper: the spring comes to rest at 0.5 / (m w^2), in the archive, too."""
    (mass, w, damping), requirements = of_spring(), requirements_for({}, move=MOVE, kinds=kinds)
    plant = spring_with_unit(tmp_path, unit, base)
    found = tune_plant(plant, "force", ["position"], requirements=requirements, start_values=damping)
    assert found.verdict == "tuned", found.summary
    assert found.verification is not None
    step = MOVE.distance / (mass * w * w)
    assert found.verification.nominal.before[0] == pytest.approx(step, rel=0.015)
    write_tuning(found, tmp_path / "tuned", report=False)
    results = load_ssp(tmp_path / "tuned" / "shaped_plant.ssp").simulate(8.0, 0.001, record=["plant.position"])
    assert results["plant.position"][-1] == pytest.approx(step, rel=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(20))
def test_twenty_plants_arrive_when_told(seed, tmp_path):
    """From the end that is told on nothing is outside of the tolerance, by DOP853 from the profile's own functions."""
    rng = np.random.default_rng(seed)
    order, mass, w = seed % 3, float(rng.uniform(0.5, 3.0)), float(np.exp(rng.uniform(0.5, 3.5)))
    values = {"mass": mass, "stiffness": mass * w * w, "damping": 2.0 * ZETA * w * mass}
    move = Move(float(rng.uniform(0.2, 2.0)), float(rng.uniform(0.3, 2.0)), float(rng.uniform(1.0, 5.0)))
    plant = spring_with_unit(tmp_path, list(INPUTS)[order])
    requirements = requirements_for({}, move=move, frequency_margin=float(rng.choice([0.0, 0.05])))
    found = tune_plant(plant, "force", ["position"], requirements=requirements, start_values=values, duration=20.0 / w)
    assert found.verdict == "tuned", found.summary
    assert found.candidate is not None
    assert found.candidate.profile is not None
    assert swing_after(found.candidate, order, w, mass) <= 0.01 * 1.02 * abs(move.distance) / (mass * w * w) * w**order
    told = found.candidate.profile.duration + found.candidate.sequence.duration
    assert float(found.summary.split("within the tolerance ")[1].split(" s")[0]) <= told + 2.0 * math.pi / w / 40.0


@pytest.mark.parametrize(
    ("unit", "move", "words"),
    [
        ("N", MOVE, r"force \[N\] is no position, speed or acceleration, so that it cannot follow a move"),
        ("m/s", Move(0.5), r"force \[m/s\] cannot jump, so the move needs limits: give max_acceleration"),
    ],
)
def test_what_cannot_follow_a_move_is_refused_before_any_experiment(unit, move, words, tmp_path):
    said = []
    with pytest.raises(ModelError, match=words):
        tune_plant(spring_with_unit(tmp_path, unit), "force", requirements=requirements_for({}, move=move), say=said.append)
    assert not said


def test_an_input_without_a_unit_is_taken_for_a_position_and_this_is_told(tmp_path):
    found = tune_plant(spring_with_unit(tmp_path, ""), "force", ["position"], requirements=requirements_for({}, move=MOVE))
    assert found.verdict == "tuned"
    assert "force has no unit and is taken for a position" in found.summary


def test_the_command_writes_the_move_and_its_report(tmp_path):
    plant = fmu_path("OverheadCrane", platforms=["this"])
    done = typed(
        "tune", plant, "--input", "trolley_acceleration", "--output", "swing_angle", "--vary", "initial_rope_length=5%",
        "--move", "2", "--max-velocity", "1", "--max-acceleration", "0.5", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert "tuned: fastest in 5.037 s" in words
    folder = tmp_path / "OverheadCrane_tuned"
    assert {"MotionProfile_OverheadCrane.fmu", "move.ssv", "shaped_plant.ssp", "report.html"} <= {p.name for p in folder.iterdir()}
    numbers = json.loads((folder / "tuning.json").read_text())
    law = numbers["choice"]["recommended"]["profile"]
    assert law["profile"] == "fastest"
    assert law["segments"] == len([t for t in law["segment_end"] if t > 0.0])
    assert numbers["command"]["kind"] == "move"
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Start values of the MotionProfile" in page
    assert "scaled to the distance" in page
    # the nonlinear pendulum on the rope of the worst place, by DOP853: what is left, as a share of distance over length
    ends = [0.0, *law["segment_end"][: law["segments"]]]
    length, state = numbers["verification"]["worst"]["values"]["initial_rope_length"], np.zeros(2)
    for begin, end, a in zip(ends, ends[1:], law["segment_acceleration"], strict=False):
        state = solve_ivp(
            lambda _, y, a=a: [y[1], -(9.81 * math.sin(y[0]) + a * math.cos(y[0])) / length],
            (begin, end), state, method="DOP853", rtol=1e-11, atol=1e-13,
        ).y[:, -1]  # fmt: skip
    left = math.sqrt(2.0 * (1.0 - math.cos(state[0])) + state[1] ** 2 * length / 9.81)
    assert left / (2.0 / length) == pytest.approx(numbers["verification"]["worst"]["share"], rel=0.03)
    wrong = typed("tune", plant, "--input", "trolley_acceleration", "--max-velocity", "1", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "this needs a distance (--move)" in wrong.stderr


def test_a_position_that_integrates_the_input_settles_where_the_move_leads():
    """The load of a crane, undamped: a step of the trolley's position by 1 m leaves an amplitude of 1 m."""
    plant, move = fmu_path("OverheadCrane", platforms=["this"]), Move(1.0, max_velocity=1.0, max_acceleration=0.3)
    found = tune_plant(plant, "trolley_acceleration", ["load_position"], requirements=requirements_for({}, move=move))
    assert found.verdict == "tuned", found.summary
    assert found.verification is not None
    assert found.verification.nominal.before[0] == pytest.approx(1.0, rel=0.015)

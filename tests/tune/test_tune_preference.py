"""Which of the shapers that fit is recommended: kinds before custom sequences, the shorter one on the plant first, and what is said."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from test_tune_nominal import nominal_plant

from shaper_fmu import fmu_path, requirements_for, tune_plant
from shaper_fmu.errors import ComponentError, ModelError
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.choice import choose
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.identify.range import Range, identify_plant
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.tuning_trial import tried

ROPES = Range(*(math.sqrt(9.81 / rope) for rope in (5.5, 5.0, 4.5)))
"""Of a crane's rope of 5 m +- 10 %: sqrt(g / l)."""
SWING = [ModeBox(ROPES, Range(0.0, 0.0, 0.0))]
CRANE = ("trolley_acceleration", ["swing_angle"])
SPREAD = {"initial_rope_length": 0.1}


def left(amplitudes, delays, w: float) -> float:
    """V of Singer and Seering 1990, undamped."""
    return float(np.abs(np.exp(1j * w * np.array(delays)) @ np.array(amplitudes)))


def test_a_kind_is_preferred_where_a_custom_sequence_saves_little():
    choice = choose(SWING, Requirements(nominal_tolerance=0.01))
    best = choice.recommended
    assert best is not None
    assert best.design.factors[0].kind == "mzv"
    worst = max(left(best.sequence.amplitudes, best.sequence.delays, w) for w in np.linspace(ROPES.low, ROPES.high, 1001))
    assert worst <= 0.05
    shortest = choose(SWING, Requirements(nominal_tolerance=0.01, least_saving=0.0)).recommended
    assert shortest is not None
    assert shortest.design.factors[0].kind == "si"
    saved = 1.0 - shortest.delay / best.delay
    assert 0.0 < saved < 0.03
    assert choice.reason.startswith(f"{best.name}: shortest of a kind of those within 5 %")
    assert f"{shortest.name} is {100.0 * saved:.3g} % shorter, but a custom sequence" in choice.reason
    with pytest.raises(ComponentError, match="least_saving = 1 is outside its domain"):
        Requirements(least_saving=1.0)


def test_the_example_of_the_readme_recommends_a_kind():
    found = tune_plant(fmu_path("OverheadCrane", platforms=["this"]), *CRANE, spread=SPREAD)
    assert found.verdict == "tuned", found.summary
    assert found.candidate is not None
    assert found.candidate.design.factors[0].kind == "mzv"
    assert found.verification is not None
    assert found.verification.worst.share <= 0.05


def test_what_fits_by_its_bound_and_is_shorter_is_tried_before_a_tighter_design():
    """The sequence for exactly 5 % leaves more on the pendulum, which is not quite linear; MZV, bounded by 4.93 %, holds."""
    requirements = requirements_for(SPREAD, least_saving=0.0)
    said: list[str] = []
    crane = fmu_path("OverheadCrane", platforms=["this"])
    found = tune_plant(crane, *CRANE, requirements=requirements, spread=SPREAD, say=said.append)
    assert found.verdict == "tuned", found.summary
    assert found.choice is not None
    ((refuted, why),) = found.choice.refuted
    assert refuted.design.factors[0].kind == "si"
    assert "more than the tolerance of 5 %" in why
    assert found.choice.requirements == requirements
    assert f"{refuted.name} ({refuted.delay:.4g} s) fits by its bound, but {why}" in found.summary
    assert "that hold on the plant" in found.summary
    assert found.candidate is not None
    assert f"trying {found.candidate.name}" in said
    assert found.choice.recommended in found.choice.front


@pytest.mark.parametrize("seed", range(12))
def test_names_tell_candidates_apart(seed: int):
    choice = choose(*nominal_plant(seed), floor=False)
    assert max(Counter(one.name for one in choice.candidates).values()) == 1
    assert all(any(one.by is other for other in choice.candidates) for one in choice.dominated)


def test_equal_names_say_in_what_they_differ():
    choice = choose(SWING, Requirements(nominal_tolerance=0.01, kinds=("ei",)), floor=False)
    names = [one.name for one in choice.candidates if one.design.factors]
    assert len(set(names)) == len(names) > 1
    assert any("(for 0.9999 %)" in name for name in names), names


def test_the_words_name_the_tolerance_that_failed():
    """An EI shaper leaves its tolerance at its design point: the range holds, the nominal plant does not."""
    plant = Plant(fmu_path("MassSpringDamper", platforms=["this"]), "force", ["position"], {"damping": 0.0})
    chosen = tune_plant(plant, requirements=Requirements(kinds=("ei",)), spread={"mass": 0.1})
    assert chosen.verdict == "tuned"
    asked = Requirements(kinds=("ei",), nominal_tolerance=0.01)
    found = tried(chosen, asked, plant)
    assert found.verdict == "not_held"
    assert found.summary.startswith("nominally it leaves ")
    assert "more than the nominal tolerance of 1 %; over the range of the parameters it leaves " in found.summary
    other = tried(chosen, replace(asked, tolerance=0.03, nominal_tolerance=1.0), plant)
    assert other.summary.startswith("over the range of the parameters it leaves ")
    assert "more than the tolerance of 3 %. For the modes found" in other.summary


def test_a_spread_beyond_all_is_refused():
    plant = Plant(fmu_path("OverheadCrane", platforms=["this"]), *CRANE)
    with pytest.raises(ModelError, match=r"cannot vary by \+-1000 % of it: did you mean 10 % \(0.1\)"):
        tune_plant(plant, spread={"initial_rope_length": 10.0})


def test_a_mode_that_moves_far_stays_in_its_range():
    """sqrt(k / m) for a mass of 0.2 to 1.8: a factor of 2.2 above the nominal one."""
    points = [{"mass": 1.0}, {"mass": 0.2}, {"mass": 1.8}]
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    (only,) = identify_plant(plant, "force", ["position"], points=points).ranges
    assert [only.natural_frequency.low, only.natural_frequency.high] == pytest.approx([10 / math.sqrt(m) for m in (1.8, 0.2)])


def test_a_range_that_lacks_a_point_says_so():
    """Strongly damped at one end, it does not vibrate there; and a rope that the hoist has used up cannot be run."""
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    found = identify_plant(plant, "force", ["position"], points=[{"damping": 1.0}, {"damping": 30.0}])
    assert [one.code for one in found.uncovered] == ["lost"]
    assert "at damping = 30.0 no mode corresponds to the one at 10 rad/s" in found.uncovered[0].text
    tuned = tune_plant(
        fmu_path("OverheadCrane", platforms=["this"]), *CRANE, spread={"initial_rope_length": 1.0}, requirements=Requirements(0.2)
    )
    assert tuned.verdict != "tuned"
    assert "The ranges of the modes do not cover all that was asked for: at initial_rope_length = 0.0" in tuned.summary

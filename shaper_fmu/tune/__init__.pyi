"""The public names of shaper_fmu.tune, each with the module that defines it."""

from shaper_fmu.tune.choice.boxes import ModeBox as ModeBox
from shaper_fmu.tune.choice.boxes import mode_boxes as mode_boxes
from shaper_fmu.tune.choice.choice import choose as choose
from shaper_fmu.tune.choice.requirements import Move as Move
from shaper_fmu.tune.choice.requirements import Requirements as Requirements
from shaper_fmu.tune.choice.result import Choice as Choice
from shaper_fmu.tune.identify.experiment import PlantIdentification as PlantIdentification
from shaper_fmu.tune.identify.experiment import experiment as experiment
from shaper_fmu.tune.identify.linearization import linearize as linearize
from shaper_fmu.tune.identify.measured import identify_measured as identify_measured
from shaper_fmu.tune.identify.measured_parts import identify_ring_downs as identify_ring_downs
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification as MeasuredIdentification
from shaper_fmu.tune.identify.range import PlantModes as PlantModes
from shaper_fmu.tune.identify.range import identify_plant as identify_plant
from shaper_fmu.tune.identify.range import operating_points as operating_points
from shaper_fmu.tune.meter import Budget as Budget
from shaper_fmu.tune.meter import BudgetError as BudgetError
from shaper_fmu.tune.tuning import Tuning as Tuning
from shaper_fmu.tune.tuning import requirements_for as requirements_for
from shaper_fmu.tune.tuning_inputs import InputsTuning as InputsTuning
from shaper_fmu.tune.tuning_inputs import tune_inputs as tune_inputs
from shaper_fmu.tune.tuning_measured import tune_axes as tune_axes
from shaper_fmu.tune.tuning_measured import tune_measured as tune_measured
from shaper_fmu.tune.tuning_plant import tune_plant as tune_plant
from shaper_fmu.tune.verification.verify import Verification as Verification
from shaper_fmu.tune.verification.verify import verify as verify

"""The public names of shaper_fmu.design, each with the module that defines it."""

from shaper_fmu.design.floor import distance_to_floor as distance_to_floor
from shaper_fmu.design.floor import shortest_duration as shortest_duration
from shaper_fmu.design.guarantees import Guarantee as Guarantee
from shaper_fmu.design.guarantees import guarantee as guarantee
from shaper_fmu.design.impulse_sequence import ImpulseSequence as ImpulseSequence
from shaper_fmu.design.modal_responses import ModalResponse as ModalResponse
from shaper_fmu.design.modal_responses import modal_response as modal_response
from shaper_fmu.design.modal_responses import step_response as step_response
from shaper_fmu.design.mode_file import read_modes as read_modes
from shaper_fmu.design.mode_selection import ModeSet as ModeSet
from shaper_fmu.design.mode_selection import Selection as Selection
from shaper_fmu.design.mode_selection import mode_sets as mode_sets
from shaper_fmu.design.mode_selection import select_modes as select_modes
from shaper_fmu.design.profiles import Profile as Profile
from shaper_fmu.design.profiles import profile as profile
from shaper_fmu.design.pulse_sequence import PulseSequence as PulseSequence
from shaper_fmu.design.pulses import carrier_pulses as carrier_pulses
from shaper_fmu.design.pulses import minimax_pulses as minimax_pulses
from shaper_fmu.design.pulses import polished_pulses as polished_pulses
from shaper_fmu.design.pulses import unity_magnitude_pulses as unity_magnitude_pulses
from shaper_fmu.design.pulses import zv_carrier_pulses as zv_carrier_pulses
from shaper_fmu.design.shapers import shaper as shaper
from shaper_fmu.design.specified_bands import Band as Band
from shaper_fmu.design.specified_bands import specified_insensitivity as specified_insensitivity
from shaper_fmu.design.two_mode import direct_two_mode as direct_two_mode

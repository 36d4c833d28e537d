"""The public names of shaper_fmu.metrics, each with the module that defines it."""

from shaper_fmu.metrics.effort import Effort as Effort
from shaper_fmu.metrics.envelope import Envelope as Envelope
from shaper_fmu.metrics.final import Final as Final
from shaper_fmu.metrics.metric import Metric as Metric
from shaper_fmu.metrics.metric import Needs as Needs
from shaper_fmu.metrics.overshoot import Overshoot as Overshoot
from shaper_fmu.metrics.peak import Peak as Peak
from shaper_fmu.metrics.residual import Residual as Residual
from shaper_fmu.metrics.settling_time import SettlingTime as SettlingTime

"""Simulation of the planned run, at any amplitude and without noise."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rhythmid.design.waveform import Waveform
from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.offline_run import perform
from rhythmid.settings import Noise, Safety

Array = NDArray[np.float64]
KEPT = 8  # simulated runs that are cached


class Rehearsal:
    """Runs of one `experiment` with commands of one shape."""

    def __init__(self, experiment: Experiment, waveform: Waveform) -> None:
        self._experiment = replace(experiment, noise=Noise(), safety=Safety(max_effort=np.inf))
        self._waveform = waveform
        self.output = lru_cache(maxsize=KEPT)(self._output)

    def _output(self, amplitude: float) -> Array:
        """Measured position [m] (n,) with the command's peak at `amplitude` [N]; a negative one inverts the command."""
        command = self._waveform.with_peak(amplitude)
        done = perform(replace(self._experiment, excitation=command))["joint_states"].position
        if done is None or not np.isfinite(done).all():
            raise InputError(f"the machine diverges under a command of {abs(amplitude):g}")
        return done

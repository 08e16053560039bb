"""What the unit tests share: the paper's hopper, and any element added to it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

import numpy as np
import pytest
from scipy.interpolate import PPoly

from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.elements.element import Scales
from rhythmid.experiment import Experiment
from rhythmid.model import Model
from rhythmid.offline_run import perform
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import Trajectory, simulate

HOPPER = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command: [{input_delay: {delay: {value: 0.0, unit: s}}}]
force:
  - gravity: {acceleration: {value: 9.81, unit: m/s^2, fixed: true}}
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.2, unit: m}}
  - switched_damper: {stance: {value: 2.0, unit: N*s/m}, flight: {value: 0.0, unit: N*s/m}}
sensor: [{measurement_delay: {delay: {value: 0.0, unit: s}}}]
"""
BARE = {  # the same structure, so the same machine code, as a free mass
    "gravity.acceleration": 0.0,
    "linear_spring.stiffness": 0.0,
    "linear_spring.rest_length": 0.0,
    "switched_damper.stance": 0.0,
    "switched_damper.flight": 0.0,
}
SCALES = Scales(
    position=0.02, velocity=0.2, effort=1.0, centre=0.151, low=0.1, high=0.21, mass=1.0, stiffness=200.0,
    frequency=1.0, duration=4.0, period=1e-3, forcing_frequency=1.0,
)  # fmt: skip


@dataclass(frozen=True)
class Rig:
    """The hopper with one more element, and a way to run it."""

    catalogue: Catalogue
    hopper: Model

    def model(self, name: str, values: dict[str, float], **nominal: float) -> Model:
        """The hopper with the element `name`; `nominal` as spring=…, rest=…, damper=… for a mass that is bare else."""
        changes = dict(BARE)
        keys = {
            "mass": "inertia.mass",
            "spring": "linear_spring.stiffness",
            "rest": "linear_spring.rest_length",
            "stance": "switched_damper.stance",
            "flight": "switched_damper.flight",
            "gravity": "gravity.acceleration",
        }
        changes |= {keys[key]: value for key, value in nominal.items()}
        return self.hopper.with_values(changes).with_element(self.catalogue[name], values)

    def run(
        self,
        model: Model,
        duration: float,
        initial: tuple[float, float] = (0.0, 0.0),
        command=None,
        forcing=None,
        max_step: float = 2.5e-4,
        period: float = 1e-3,
        seed: int | None = None,
    ) -> Trajectory:
        """Simulate from t = 0; `command` is a function of the stamps, held between them, or a continuous signal."""
        times = np.arange(round(duration / period) + 1, dtype=np.float64) * period
        if command is not None and not isinstance(command, PPoly):
            command = zero_order_hold(times, np.asarray(command(times), dtype=float))
        return simulate(model, times, command, forcing, initial, max_step, seed)


@pytest.fixture(scope="session")
def catalogue() -> Catalogue:
    return load_catalogue()


@pytest.fixture(scope="session")
def rig(catalogue: Catalogue) -> Rig:
    return Rig(catalogue, Model.from_text(HOPPER, catalogue=catalogue))


@pytest.fixture(scope="session")
def scales() -> Scales:
    return SCALES


PAPER_EXPERIMENT = """
model: paper_hopper.yaml
excitation: {{type: chirp, amplitude: {amplitude}, band: [0, 7], sweep: 30.0, repetitions: 9, warm_up: {warm_up},
             shift: {{period: 1.0, count: 9}}}}
forcing: {{amplitude: 1.0, frequency: 1.0, phase: {phase}}}
delays: {{input: {delays[0]}, measurement: {delays[1]}}}
noise: {{measurement_std: {noise}}}
"""


@pytest.fixture(scope="session")
def paper_record() -> Callable[..., Record]:
    """The paper's experiment as a user of the robot sees it, by delays (τ_u, τ_y), noise [m], phase of the forcing, …"""

    @lru_cache(maxsize=16)
    def made(
        delays: tuple[float, float] = (0.04, 0.05),
        noise: float = 0.0,
        phase: float = 0.0,
        amplitude: float = 0.004,
        warm_up: int = 1,
    ) -> Record:
        text = PAPER_EXPERIMENT.format(
            delays=delays, noise=noise, phase=phase, amplitude=amplitude, warm_up=warm_up
        )
        topics = perform(Experiment.from_text(text, str(files("rhythmid") / "models")))

        def channel(topic: str, field: str, unit: str) -> Channel:
            return Channel(topics[topic].stamp_ns * 1e-9, getattr(topics[topic], field), unit)

        return Record(
            "paper",
            channel("joint_states", "position", "m"),
            channel("excitation", "effort", "N"),
            channel("forcing", "effort", "N"),
        )

    return made

"""A small hopper and short records of it, for tests of estimation and diagnosis."""

from pathlib import Path

from rhythmid.diagnose.search.forward import Search
from rhythmid.diagnose.search.trial import Trial
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.excitation.sequence import build
from rhythmid.experiment import Delay, Experiment, Forcing, Noise, TimeMode
from rhythmid.identify.output_error import Fit
from rhythmid.identify.start_cost import felt_starts, start_cost
from rhythmid.model import Model
from rhythmid.offline_run import perform
from rhythmid.record.record import Channel, Record

CATALOGUE = load_catalogue()
HOPPER = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
command: [{input_delay: {delay: {value: 0.0, unit: s}}}]
force:
  - gravity: {acceleration: {value: 9.81, unit: m/s^2, fixed: true}}
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.2, unit: m}}
  - switched_damper: {stance: {value: 2.0, unit: N*s/m}, flight: {value: 0.0, unit: N*s/m, fixed: true}}
sensor: [{measurement_delay: {delay: {value: 0.0, unit: s}}}]
"""
SHORT = (
    ({"type": "chirp", "amplitude": 0.3, "sweep": 10.0, "band": [0.0, 7.0]}, 1.0),
    ({"type": "chirp", "amplitude": 1.2, "sweep": 10.0, "band": [7.0, 0.0]}, 1.0),
    ({"type": "silence", "length": 6.0}, 3.0),
)


def only(*names: str) -> Catalogue:
    """The catalogue with these candidates: each one more is a model to compile and to fit."""
    return CATALOGUE.without(*[n for n, e in CATALOGUE.items() if e.candidate and n not in names])


def hopper() -> Model:
    """The paper's hopper with free stiffness, rest length, damping and delays."""
    return Model.from_text(HOPPER, catalogue=CATALOGUE)


def record(
    machine: Model,
    excitation: dict,
    forcing: float = 1.0,
    delays=(0.0203, 0.0151),
    std=1e-4,
    correlation=0.0,
    seed=0,
):
    """A record of the machine at 1 kHz; delays [s] and noise [m] as given."""
    made = build(excitation)
    run = Experiment(
        machine, Path("none"), made, excitation, Forcing(forcing), Delay(delays[0]), Delay(delays[1]),
        Noise(std, correlation), TimeMode(), made.duration, seed,
    )  # fmt: skip
    topics = perform(run)
    u, f, y = topics["excitation"], topics["forcing"], topics["joint_states"]
    return Record(
        f"record {seed}",
        Channel(y.stamp_ns * 1e-9, y.position, "m"),
        Channel(u.stamp_ns * 1e-9, u.effort, "N"),
        Channel(f.stamp_ns * 1e-9, f.effort, "N"),
    )


def records(machine: Model, protocol=SHORT, seed: int = 0, **options) -> list[Record]:
    """One record of the machine for each (excitation, forcing amplitude) of the protocol."""
    return [
        record(machine, spec, forcing, seed=10 * seed + i, **options)
        for i, (spec, forcing) in enumerate(protocol)
    ]


def search_of(fit: Fit, *labels: str) -> Search:
    """A search that ended in this fit, whose model has these elements more."""
    cost = start_cost(
        felt_starts(fit.model, fit.run, fit.noise, fit.starts, fit.residuals, fit.differences[1])
    )
    trial = Trial(
        labels, fit.model, fit.starts, fit.chi2, fit.samples, len(fit.names), True, fit.noise, fit.differences, cost
    )  # fmt: skip
    return Search(fit, trial, fit, fit.noise, (trial,), (), ())

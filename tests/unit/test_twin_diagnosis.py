"""The live twin's diagnosis: a mismatch that has lasted for a minute gets the name of what the model lacks."""

import numpy as np

from rhythmid.elements.catalogue import load_catalogue
from rhythmid.excitation.multisine import Multisine
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.signal import zero_order_hold
from rhythmid.simulation.simulate import simulate
from rhythmid.twin.settings import Settings
from rhythmid.twin.watch import DIAGNOSED, Watch, watch_record

SLIDER = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 100.0, unit: N/m, fixed: true}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 2.0, unit: N*s/m}}
"""
HEALTHY = 20.0  # s
RATE = 25.0  # Hz: few samples, so that the search is short
NOISE = 1e-4  # m
RUBS = 0.5  # N


def test_a_mismatch_of_a_minute_is_diagnosed_with_the_name_of_what_the_model_lacks():
    catalogue = load_catalogue()
    model = Model.from_text(SLIDER, catalogue=catalogue)
    rubbing = model.with_element(catalogue["coulomb_friction"], {"force": RUBS})
    begins = HEALTHY + 8.0  # s: five after the healthy stretch the twin judges
    time = np.arange(round((begins + DIAGNOSED + 3.0) * RATE)) / RATE
    excitation = Multisine(rms=2.0, period=10.0, periods=1, band=(0.3, 6.0), seed=1)
    command = excitation(np.mod(time, excitation.period))
    held, healthy = zero_order_hold(time, command), time <= begins
    before = simulate(model, time[healthy], held, None, np.zeros(2))
    after = simulate(rubbing, time[~healthy], held, None, before.states[-1])
    measured = np.concatenate([before.output, after.output])
    measured += NOISE * np.random.default_rng(0).standard_normal(len(time))
    record = Record("slider", Channel(time, measured, "m"), Channel(time, command, "N"))
    watch = Watch(model, Settings(healthy=HEALTHY), forced=False)
    try:
        watch_record(record, watch)
        watch.close(wait=True)
    finally:
        watch.close()
    (event,) = watch.events.found
    assert event.isolation is not None and event.isolation.slot == "force"
    assert event.diagnosis is not None and event.diagnosis["verdict"] == "missing_physics"
    assert [one["element"] for one in event.diagnosis["missing"]] == ["coulomb_friction"]

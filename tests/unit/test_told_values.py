"""What the records tell of a parameter: a value whose standard deviation exceeds it, and all that there may be, is no answer."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rhythmid.diagnose.answer.compose import missing_effects
from rhythmid.diagnose.answer.result import Estimate
from rhythmid.diagnose.joints import joint_compose
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.identify.identify import identify
from rhythmid.identify.natural_size import are_told
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record

TIME = 0.01 * np.arange(200)
NOISE = np.random.default_rng(5).standard_normal((4, len(TIME)))
MODEL = Model.from_text(
    "inertia: {mass: {value: 0.1}}\nforce: [viscous_damper: {damping: {value: 0.2}}]", "model.yaml"
)


def steady(speed: float, noise: np.ndarray, name: str) -> Record:
    """A machine that goes at one speed against dry friction, whose effort is noise about a constant."""
    effort = 0.2 + 0.1 * speed + 0.01 * noise[0]
    return Record(
        name,
        Channel(TIME, speed * TIME + 1e-4 * noise[1], "m"),
        Channel(TIME, effort, "N"),
        hold="band_limited",
    )


def test_a_fit_that_follows_the_motion_whatever_its_values_is_not_usable():
    found = identify([steady(0.5, NOISE[:2], "slow"), steady(1.0, NOISE[2:], "fast")], MODEL)
    assert found.quality["nrmse"] < 0.02
    assert [one.value for one in found.parameters.values()] == [None, None]
    assert found.delays.sum.value is None
    assert not found.usable and "determine none of its values" in found.headline
    assert "determine none of its values" in found.cautions[0].text


def test_a_value_near_zero_is_told_where_it_is_small_beside_all_that_there_may_be():
    series = prepare([steady(0.5, NOISE[:2], "slow")])
    name = "viscous_damper.damping"
    assert are_told(MODEL, series, {name: (0.0, 1e-9)}) == {name}
    assert are_told(MODEL, series, {name: (0.1, 0.09)}) == {name}
    assert are_told(MODEL, series, {name: (0.1, 1e3)}) == set()


def test_a_nuisance_that_the_records_do_not_determine_is_given_no_standard_deviation():
    model = MODEL.with_element(load_catalogue()["coulomb_friction"], {"force": 0.08})
    known = scales(prepare([steady(5.0, NOISE[:2], "fast")]), model)

    def judged(force: float, transition: tuple[float, float]) -> list[float | None]:
        values = {"force": Estimate(0.01, force, "N"), "transition": Estimate(*transition, "m/s")}
        decision: Any = SimpleNamespace(
            named=("coulomb_friction",),
            shares={"coulomb_friction": 1.0},
            probability={"coulomb_friction": 1.0},
        )
        (effect,) = missing_effects(model, decision, lambda name: values[name.split(".")[1]], known)
        return [one.std for one in effect.parameters.values()]

    tiny = 0.01 * known.velocity
    assert judged(0.005, (0.0, 230.0)) == [0.005, None]
    assert judged(0.005, (0.0, tiny)) == [0.005, tiny]
    assert judged(9e9, (0.2, 0.1)) == [9e9, 0.1]


def test_an_effect_at_a_joint_has_no_standard_deviation_either_where_the_records_tell_nothing(
    monkeypatch: pytest.MonkeyPatch,
):
    model = MODEL.with_element(load_catalogue()["coulomb_friction"], {"force": 0.08})
    label, known = "coulomb_friction", scales(prepare([steady(5.0, NOISE[:2], "fast")]), model)
    monkeypatch.setattr(joint_compose, "scales_of", lambda *_: known)
    for name in ("_gain", "shared_among", "probability_together"):
        monkeypatch.setattr(joint_compose, name, lambda *_: 1.0)
    chosen = SimpleNamespace(fit=SimpleNamespace(model=model))
    decision = SimpleNamespace(shares={label: 1.0}, probability={label: 1.0})
    result = SimpleNamespace(decision=decision, chosen=chosen, search=SimpleNamespace(balance=None))
    one: Any = SimpleNamespace(joint="knee", result=result)
    answer: Any = SimpleNamespace(
        parameters={
            f"{label}.force": Estimate(0.01, 0.005, "N"),
            f"{label}.transition": Estimate(0.0, 230.0, "m/s"),
        }
    )
    effect = joint_compose._effect(SimpleNamespace(), one, answer, label)  # pyright: ignore[reportPrivateUsage, reportArgumentType]
    assert [size.std for size in effect.parameters.values()] == [0.005, None]

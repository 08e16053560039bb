"""Other machines than hoppers: records of joints, pendulums, servos, rigs and free decays, by equations of their own.

`python tests/proof/test_machines.py` runs all twins, effects and nulls, and prints what was found; a few of them are tests.
"""

import sys
import time
from collections.abc import Callable

import pytest
import twins
from json_schema import conforming
from twins import Twin

from machines import only
from rhythmid.diagnose.answer.compose_effort import NO_SENSOR
from rhythmid.diagnose.diagnosis import Answer, diagnose
from rhythmid.elements.catalogue import Catalogue
from rhythmid.model import Model

NAMED: dict[str, Callable[[], Twin]] = {
    "axis under a controller, sticking and slipping, driven by its motor's effort": twins.axis,
    "servo of which only command and motion are known": twins.servo,
    "free decay without any input": twins.decay,
}
KIN = {  # instead of the whole catalogue, every law of which would be compiled with a controller: what is like the effect
    "servo of which only command and motion are known": only(
        "actuator_saturation", "actuator_deadband", "actuator_lag", "actuator_rate_limit", "reference_rate_limit", "coulomb_friction",
        "quadratic_drag", "cubic_stiffness", "command_lag", "sensor_lag",
    )
}  # fmt: skip
NULLS: dict[str, Callable[[], Twin]] = {
    "joint": lambda: twins.joint(friction=0.0),
    "rig on a shaken base": lambda: twins.rig(cubic=0.0),
    "film at 30 Hz": lambda: twins.camera(""),
}
SLOW: dict[str, Callable[[], Twin]] = {
    "joint driven by a current, velocity measured": twins.joint,
    "pendulum driven through large swings": twins.pendulum,
    # not named: the position, integrated from the speed, drifts along the gravity
    "joint, velocity, with a heavy link": lambda: twins.joint(0.0, weight=0.5),
    "axis in closed loop from its reference": lambda: twins.axis(known="reference"),
    "pendulum, free decay": lambda: twins.pendulum(driven=False),
    "rig, base displacement": twins.rig,
    "rig, base acceleration": lambda: twins.rig(kind="base_acceleration"),
    "servo, set-point ramp": lambda: twins.servo("reference_rate_limit"),
    "servo, dead band": lambda: twins.servo("actuator_deadband"),
    "servo, friction": lambda: twins.servo("coulomb_friction"),
    "free decay to a standstill, friction": lambda: twins.decay("coulomb_friction"),
    "film at 30 Hz, pixels": twins.camera,
    "circuit at 10 kHz, volts": twins.circuit,
    "null: axis from effort": lambda: twins.axis(friction=0.0),
    "null: axis from reference": lambda: twins.axis(friction=0.0, known="reference"),
    "null: pendulum": lambda: twins.pendulum(large=False),
    "null: rig, base acceleration": lambda: twins.rig(cubic=0.0, kind="base_acceleration"),
    "null: servo": lambda: twins.servo(""),
    "null: free decay": lambda: twins.decay(""),
    "null: circuit": lambda: twins.circuit(cubic=0.0),
}


def examined(twin: Twin, catalogue: Catalogue | None = None) -> Answer:
    answer = diagnose(twin.records, Model.from_text(twin.nominal), catalogue=catalogue)
    conforming(answer.diagnosis)
    return answer


@pytest.mark.parametrize("name", NAMED)
def test_the_missing_effect_is_named_and_measured(name):
    twin = NAMED[name]()
    result = examined(twin, KIN.get(name)).diagnosis
    assert result.verdict == "missing_physics"
    assert [effect.element for effect in result.missing] == [twin.lacks]
    for key, true in twin.truth.items():
        found = result.missing[0].parameters[key]
        assert found.std is not None and abs(found.value - true) < 4.0 * found.std < 0.2 * true
    after, before = result.augmented.heldout_nrmse, result.refitted_nominal.heldout_nrmse
    assert after is not None and before is not None and after < 0.9 * before


@pytest.mark.parametrize("name", NULLS)
def test_a_machine_that_lacks_nothing_is_told_so(name):
    result = examined(NULLS[name]()).diagnosis
    assert (result.verdict, result.missing) == ("consistent", ())


def test_a_machine_that_integrates_is_scored_by_its_effort_and_it_is_said():
    answer = examined(twins.axis(friction=0.0, count=1, duration=6.0))
    told = answer.diagnosis
    assert told.scoring.kind == "effort" and told.scoring.bandwidth > 0.0 and told.scoring.reason
    assert NO_SENSOR in told.assumptions
    assert told.heldout == "held out: every block of the records in its turn"
    assert told.parameters["inertia.mass"].value == pytest.approx(2.0, rel=1e-3)
    assert told.parameters["viscous_damper.damping"].value == pytest.approx(8.0, rel=1e-3)


def main(names: list[str]) -> None:
    every = {**NAMED, **{f"null: {name}": make for name, make in NULLS.items()}, **SLOW}
    for name in names or every:
        twin, begin = every[name](), time.process_time()
        result = examined(twin).diagnosis
        said = ", ".join(effect.element for effect in result.missing) or "nothing"
        others = "; ".join(" / ".join(group) for group in result.indistinguishable)
        print(f"{name}: lacks {twin.lacks or 'nothing'}; {result.verdict}: {said} {others}", flush=True)
        for key, true in twin.truth.items():
            for effect in result.missing:
                if effect.element == twin.lacks and key in effect.parameters:
                    found = effect.parameters[key]
                    print(f"    {key} {found.value:.6g} ± {found.std or 0.0:.2g}, true {true:.6g}")
        print(
            f"    {result.scoring.kind}: {result.scoring.reason}; {time.process_time() - begin:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main(sys.argv[1:])

"""Parameters that records declare: read, refused, and applied wherever a record is simulated."""

from dataclasses import replace

import numpy as np
import pytest

from machines import hopper, record
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.declared import own_model, with_declared
from rhythmid.identify.drive import driven
from rhythmid.identify.free_run import prepare_run, start_of
from rhythmid.identify.joint import fit_from
from rhythmid.identify.output_error import estimate
from rhythmid.identify.series import prepare
from rhythmid.model import Model
from rhythmid.record.read import read_record
from rhythmid.record.record import Channel, Record
from rhythmid.record.signals import Signals

GAIN = "position_control.proportional"
SERVO = """
inertia: {mass: {value: 0.01, unit: kg*m^2}}
command: [{position_control: {proportional: {value: 1.0, unit: V/rad}}}]
actuator: [{dc_motor: {torque_constant: {value: 0.3, unit: N*m/A, fixed: true}, resistance: {value: 2.5, unit: ohm}}}]
force: [{viscous_damper: {damping: {value: 0.01, unit: N*m*s/rad, fixed: true}}}]
"""
TRUTH = {"inertia.mass": 0.013, "dc_motor.resistance": 2.1}
GAINS = {"soft": 8.0, "stiff": 30.0}
TIME = np.arange(600) * 5e-3
TABLE = "time: {sample_rate: 200}\ninput: {column: r, kind: reference, unit: rad}\noutput: {column: q, unit: rad}\n"


def servo() -> Model:
    return Model.from_text(SERVO, catalogue=load_catalogue())


def reference(name: str) -> Channel:
    rng = np.random.default_rng(len(name))
    return Channel(TIME, np.repeat(rng.uniform(-0.5, 0.5, 15), 40), "rad")


def records() -> list[Record]:
    """Two records of one servo, each made with its own gain, which it declares."""
    found = []
    for name, gain in GAINS.items():
        machine = servo().with_values(TRUTH | {GAIN: gain})
        empty = Record(
            name, Channel(TIME, np.sin(TIME), "rad"), reference(name), input_kind="reference", hold="zero"
        )
        run = prepare_run(machine, prepare([empty], block=1), 1e-3)
        (output,) = run.outputs(machine, [start_of(machine, run, 0, 0.0, 0.0)]) or (np.empty(0),)
        found.append(
            Record(
                name, Channel(TIME, output, "rad"), reference(name), input_kind="reference", hold="zero",
                parameters={GAIN: gain},
            )
        )  # fmt: skip
    return found


def test_gains_that_differ_from_record_to_record_are_applied_to_each_and_not_estimated():
    given = records()
    model = with_declared(servo(), given)
    assert GAIN in servo().free and GAIN not in model.free
    fit = estimate(model, prepare(given, block=1))
    assert set(fit.names) == set(TRUTH)
    for name, value in TRUTH.items():
        assert fit.model.value(name) == pytest.approx(value, rel=1e-4)
    assert fit.nrmse() < 1e-4


def test_without_the_declared_gains_one_gain_does_not_explain_both_records():
    undeclared = [Record(r.name, r.output, r.input, input_kind="reference", hold="zero") for r in records()]
    assert estimate(servo(), prepare(undeclared, block=1), iterations=8).nrmse() > 0.02


def test_what_only_some_records_declare_is_still_estimated_from_the_others():
    soft, stiff = records()
    undeclared = Record(stiff.name, stiff.output, stiff.input, input_kind="reference", hold="zero")
    model = with_declared(servo(), [soft, undeclared]).with_values(TRUTH | {GAIN: 25.0})
    fit = estimate(model, prepare([soft, undeclared], block=1))
    assert fit.model.value(GAIN) == pytest.approx(GAINS["stiff"], rel=1e-3)


def test_a_payload_that_differs_and_is_declared_leaves_the_hopper_s_stiffness_the_same():
    masses = {"empty": 1.0, "loaded": 1.3}
    given = [
        replace(
            record(
                hopper().with_values({"inertia.mass": mass}),
                {"type": "chirp", "amplitude": 0.3, "sweep": 6.0, "band": [0, 5]},
            ),
            name=name,
            parameters={"inertia.mass": mass},
        )
        for name, mass in masses.items()
    ]
    start = hopper().with_values(
        {"input_delay.delay": 0.02, "measurement_delay.delay": 0.015, "linear_spring.stiffness": 195.0}
    )
    fit = fit_from(start, given)
    assert fit.model.value("linear_spring.stiffness") == pytest.approx(200.0, rel=1e-3)
    assert fit.model.value("switched_damper.stance") == pytest.approx(2.0, rel=0.01)


def test_a_series_is_simulated_with_what_its_record_declares():
    one = prepare(records(), block=1)[0]
    assert own_model(servo(), one).value(GAIN) == GAINS["soft"]
    assert GAIN not in own_model(servo(), one).free


@pytest.mark.parametrize("where", [lambda r: driven(r, servo()), lambda r: with_declared(servo(), [r])])
def test_a_record_that_declares_what_the_model_does_not_have_is_refused_in_one_line(where):
    soft = records()[0]
    wrong = Record(
        "odd", soft.output, soft.input, input_kind="reference", parameters={"position_control.kp": 1.0}
    )
    with pytest.raises(
        InputError, match="odd: declares 'position_control.kp', which is no parameter"
    ) as caught:
        where(wrong)
    assert "\n" not in str(caught.value)


def test_a_declared_value_outside_the_parameter_s_bounds_is_refused():
    soft = records()[0]
    wrong = Record("odd", soft.output, soft.input, input_kind="reference", parameters={GAIN: -1.0})
    with pytest.raises(
        InputError, match=r"odd: declares position_control.proportional = -1, outside \[0, inf\]"
    ):
        driven(wrong, servo())


def table(folder, name: str, lines: str) -> str:
    rows = "\n".join(f"{0.1 * (i % 7)},{0.01 * (i % 5)}" for i in range(60))
    (folder / "run.csv").write_text(f"r,q\n{rows}\n", encoding="utf-8")
    (folder / name).write_text(TABLE.replace("column: r", "file: run.csv, column: r").replace(
        "column: q", "file: run.csv, column: q") + lines, encoding="utf-8")  # fmt: skip
    return str(folder / name)


def test_signals_yaml_declares_a_value_for_its_record(tmp_path):
    given = read_record(table(tmp_path, "soft.yaml", "parameters: {position_control.proportional: 12.5}\n"))
    assert given.parameters == {GAIN: 12.5}
    assert given.cut(0.0, 0.2).parameters == {GAIN: 12.5}


def test_one_signals_yaml_declares_values_for_several_records_by_name(tmp_path):
    lines = "parameters: {position_control.proportional: {soft: 8, stiff: 30}}\n"
    assert read_record(table(tmp_path, "stiff.yaml", lines)).parameters == {GAIN: 30.0}
    with pytest.raises(InputError, match="has no value for the record 'other'"):
        read_record(table(tmp_path, "other.yaml", lines))


@pytest.mark.parametrize("value", ["high", "[1, 2]", ".nan"])
def test_a_declared_value_that_is_no_number_is_refused_with_its_line(value):
    with pytest.raises(InputError, match="signals.yaml:4: parameters.position_control.proportional"):
        Signals.from_text(TABLE + f"parameters: {{position_control.proportional: {value}}}\n")

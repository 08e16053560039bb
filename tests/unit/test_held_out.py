"""`identify` with held-out records: they are never fitted, only predicted, and the answer tells how well."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.identify.identify import identify
from rhythmid.identify.present import present
from rhythmid.model import Model
from rhythmid.record.record import Channel, Record
from rhythmid.report.page import render
from rhythmid.simulation.simulate import simulate

NOISE = 5e-3  # [rad]
TIME = 0.02 * np.arange(500)


def machine(stiffness: float = 20.0) -> Model:
    return Model.from_text(f"""
units: {{force: rad/s^2, position: rad}}
inertia: {{mass: {{value: 1.0, fixed: true}}}}
force:
  - linear_spring: {{stiffness: {{value: {stiffness}}}, rest_length: {{value: 0.0, fixed: true}}}}
  - viscous_damper: {{damping: {{value: 0.3}}}}
""")


def release(name: str, start: float, zero: float = 0.0, truth: Model | None = None) -> Record:
    """A release from rest at `start` [rad], measured at 50 Hz."""
    noise = NOISE * np.random.default_rng(len(name)).standard_normal(len(TIME))
    motion = simulate(truth or machine(), TIME, initial=(start, 0.0)).output
    return Record(name, Channel(TIME, motion + zero + noise, "rad"))


FITTED = release("wide", 1.5)
NARROW = release("narrow", 0.5)
SMALL = release("by hand", 0.8)


def size(record: Record) -> float:
    return float(np.std(record.output.value))


def of_noise(nrmse: float | None, record: Record) -> bool:
    """Whether an error is that of the noise, of which averages over a few samples hold less."""
    return nrmse is not None and 0.3 * NOISE < nrmse * size(record) < NOISE


@pytest.fixture(scope="module")
def found():
    return identify(FITTED, machine(15.0), holdout=[NARROW, SMALL])


def test_of_a_right_model_the_held_out_records_leave_only_their_noise(found) -> None:
    told = found.to_dict()["held_out"]
    assert [one["record"] for one in told["records"]] == ["narrow", "by hand"]
    for one, record in zip(told["records"], (NARROW, SMALL), strict=True):
        assert of_noise(one["nrmse"], record)
        assert one["missing"] is None
    errors = [one["nrmse"] * size(r) for one, r in zip(told["records"], (NARROW, SMALL), strict=True)]
    assert told["nrmse"] == pytest.approx(np.hypot(*errors) / np.hypot(size(NARROW), size(SMALL)), rel=0.01)


def test_no_fit_sees_a_held_out_record(found) -> None:
    alone = identify(FITTED, machine(15.0))
    other = identify(FITTED, machine(15.0), holdout=release("other", 1.0, truth=machine(40.0)))
    assert alone.held_out is None and alone.to_dict()["held_out"] is None
    assert alone.parameters == found.parameters == other.parameters
    assert alone.quality["nrmse"] == found.quality["nrmse"]
    assert other.held_out is not None and other.held_out.nrmse > 0.5


def test_the_terminal_and_the_table_tell_the_errors_beside_the_fitted_one(found) -> None:
    text = found.summary()
    assert text.index("free-run NRMSE") < text.index("held out: free-run NRMSE") < text.index("narrow: NRMSE")
    assert "of the held-out motion" in found.headline
    assert [row["record"] for row in found.tables()["held_out"]] == ["narrow", "by hand"]


def test_the_report_draws_held_out_records_beside_the_model(found) -> None:
    page = render(present(found))
    assert "narrow (held out)" in page and "wide (used in the fit)" in page
    assert "of that of the held-out records" in page


@pytest.mark.parametrize("name", ["wide", "a copy"])
def test_a_record_that_is_fitted_cannot_be_held_out(name: str) -> None:
    with pytest.raises(InputError, match=f"^{name}: is fitted and held out"):
        identify([FITTED, NARROW], machine(), holdout=replace(FITTED, name=name))


def test_a_record_in_another_unit_is_refused() -> None:
    output = replace(NARROW.output, value=1000.0 * NARROW.output.value)
    with pytest.raises(InputError, match="do not look like one machine"):
        identify(FITTED, machine(), holdout=replace(NARROW, output=output))


def test_a_zero_of_its_own_is_estimated_where_the_fitted_records_have_theirs() -> None:
    """Else it is told, and left as it is."""
    fitted = [FITTED, release("second", 1.2, zero=0.2)]
    judged = release("third", 1.0, zero=-0.3)
    found = identify(fitted, machine(15.0), holdout=judged)
    assert found.held_out is not None and of_noise(found.held_out.nrmse, judged)
    alone = identify(FITTED, machine(15.0), holdout=judged)
    assert alone.held_out is not None and alone.held_out.nrmse > 0.5
    assert any("zero of the held-out third is -0.3" in note for note in alone.notes)


def test_where_the_model_cannot_be_run_one_line_says_so(monkeypatch) -> None:
    def diverges(*_: object) -> None:
        raise InputError("the simulation diverges")

    monkeypatch.setattr("rhythmid.identify.held_out.start_only", diverges)
    found = identify(FITTED, machine(15.0), holdout=NARROW)
    told = found.to_dict()["held_out"]
    assert told == {
        "nrmse": None,
        "records": [{"record": "narrow", "nrmse": None, "missing": "the simulation diverges"}],
    }
    assert "held out, narrow: no free run: the simulation diverges" in found.summary()
    assert "could not be run" in render(present(found))


def test_the_papers_method_is_judged_by_held_out_records_too(paper_record) -> None:
    record = paper_record()
    output = record.output
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(output))
    other = replace(record, name="other", output=replace(output, value=output.value + noise))
    found = identify(record, method="paper", holdout=other)
    assert found.held_out is not None and found.held_out.nrmse < 5e-3
    assert "other (held out)" in render(present(found))


def test_the_command_takes_held_out_records(command, refused, tmp_path: Path) -> None:
    machine(15.0).save(tmp_path / "model.yaml")
    (tmp_path / "signals.yaml").write_text(
        "time: {column: t}\noutput: {column: angle, unit: rad}\n", encoding="utf-8"
    )
    for record in (FITTED, NARROW):
        rows = np.column_stack([record.output.time, record.output.value])
        np.savetxt(tmp_path / f"{record.name}.csv", rows, delimiter=",", header="t,angle", comments="")
    given = ("identify", "wide.csv", "--signals", "signals.yaml", "--model", "model.yaml", "--holdout")
    answer = command(*given, "narrow.csv", "--json", "found.json")
    assert answer.code == 0, answer
    told = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["held_out"]
    assert of_noise(told["nrmse"], NARROW)
    assert "held out: free-run NRMSE" in answer.out
    assert "wide: is fitted and held out" in refused(*given, "wide.csv")

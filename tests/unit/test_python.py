"""rhythmid from Python: a fast import, functions beside packages of the same name, and results that print, tabulate and draw."""

import doctest
import importlib
import inspect
import json
import math
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import rhythmid as rh
from rhythmid.identify.joint_covariance import JointCovariance
from rhythmid.ltp.htf import HarmonicTransferFunctions
from rhythmid.model import Model
from rhythmid.output import write_json
from rhythmid.record.record import Channel, Record
from rhythmid.result import Result, optional

FUNCTIONS = {
    "batch": "rhythmid.batch.batch",
    "compare": "rhythmid.compare.compare",
    "design": "rhythmid.design.designer",
    "diagnose": "rhythmid.diagnose.diagnosis",
    "identify": "rhythmid.identify.identify",
    "load": "rhythmid.record.load",
    "simulate": "rhythmid.offline_run",
}
CLASSES = {  # with an example of their own
    "Experiment": "rhythmid.experiment",
    "Identification": "rhythmid.identify.identification",
    "JointCovariance": "rhythmid.identify.joint_covariance",
    "Model": "rhythmid.model",
    "OfflineRun": "rhythmid.offline_run",
    "Record": "rhythmid.record.record",
}
IMPORT = 0.1  # s of processor time
OSCILLATOR = """
inertia: {mass: {value: 1.0, unit: kg, fixed: true}}
force:
  - linear_spring: {stiffness: {value: 200.0, unit: N/m}, rest_length: {value: 0.0, unit: m, fixed: true}}
  - viscous_damper: {damping: {value: 1.0, unit: N*s/m}}
"""
RUN = {
    "excitation": {"type": "chirp", "amplitude": 1.0, "sweep": 6.0},
    "forcing": {"amplitude": 0.0},
    "noise": {"measurement_std": 1e-5},
}


@pytest.fixture(scope="module")
def run():
    return rh.simulate(Model.from_text(OSCILLATOR), RUN)


@pytest.fixture(scope="module")
def found(run):
    guess = Model.from_text(OSCILLATOR).with_values({"linear_spring.stiffness": 180.0})
    return rh.identify(run.record, guess)


@pytest.fixture
def axis():
    return Figure().subplots()


def test_the_import_is_fast_and_brings_nothing_with_it():
    code = (
        "import time, sys; t = time.process_time(); import rhythmid; t = time.process_time() - t;"
        "print(t, any(name in sys.modules for name in ('numpy', 'yaml', 'numba', 'rich')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=600.0, check=True
    )
    seconds, heavy = done.stdout.split()
    assert float(seconds) < IMPORT and heavy == "False"


def test_every_public_name_is_there_and_others_are_not():
    assert set(rh.__all__) <= set(dir(rh))
    for name in rh.__all__:
        assert getattr(rh, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'identity'"):
        _ = rh.identity


@pytest.mark.parametrize(("name", "module"), FUNCTIONS.items())
def test_a_function_has_its_signature_and_a_documented_example(name, module):
    function = getattr(importlib.import_module(module), name)
    assert inspect.signature(getattr(rh, name)) == inspect.signature(function)
    assert inspect.unwrap(getattr(rh, name)) is function
    for section in ("Parameters\n", "Raises\n", "Examples\n"):
        assert section in inspect.getdoc(function), section


@pytest.mark.parametrize(("name", "module"), CLASSES.items())
def test_a_class_has_its_attributes_and_a_documented_example(name, module):
    described = inspect.getdoc(getattr(importlib.import_module(module), name)) or ""
    assert "Attributes\n" in described and "Examples\n" in described and ">>> " in described


@pytest.mark.parametrize("module", sorted({*FUNCTIONS.values(), *CLASSES.values()}))
def test_the_examples_of_the_docstrings_run(module):
    outcome = doctest.testmod(importlib.import_module(module))
    assert outcome.attempted > 0 and outcome.failed == 0


def test_a_package_of_the_same_name_stays_a_package():
    from rhythmid.identify.identify import identify

    assert rh.identify.identify.identify is identify
    with pytest.raises(rh.InputError, match="at least one record"):
        rh.identify([])


def test_a_simulated_run_is_the_record_that_its_bag_holds(run, tmp_path):
    record, read = run.record, rh.load(run.save(tmp_path / "bag"))
    for role, channel in record.channels.items():
        np.testing.assert_allclose(channel.time, read.channels[role].time, atol=1e-9)
        np.testing.assert_array_equal(channel.value, read.channels[role].value)
        assert (channel.unit, channel.source) == (read.channels[role].unit, read.channels[role].source)
    assert record.run == read.run
    with pytest.raises(rh.InputError, match="exists already"):
        run.save(tmp_path / "bag")


def test_only_a_part_of_a_recording_is_used_on_request(run, tmp_path):
    record = rh.load(run.save(tmp_path / "bag"), use=(1.0, 3.0))
    assert record.output.time[0] == pytest.approx(1.0) and record.duration == pytest.approx(2.0, abs=0.01)


def test_an_experiment_may_hold_numpy_values_and_nothing_that_is_no_value():
    described = RUN | {"excitation": {"type": "chirp", "amplitude": np.float64(1.0), "sweep": 0.2}}
    assert rh.simulate(Model.from_text(OSCILLATOR), described).experiment.count == 200
    with pytest.raises(rh.InputError, match="experiment: .* is no plain value"):
        rh.simulate(Model.from_text(OSCILLATOR), RUN | {"noise": object()})
    with pytest.raises(rh.InputError, match="exitation: unknown key; did you mean 'excitation'"):
        rh.simulate(Model.from_text(OSCILLATOR), {"exitation": {}})


def test_command_and_function_give_the_same_answer(run, found, tmp_path, command):
    run.save(tmp_path / "bag")
    guess = Model.from_text(OSCILLATOR).with_values({"linear_spring.stiffness": 180.0})
    guess.save(tmp_path / "model.yaml")
    done = command("identify", "bag", "--model", "model.yaml", "--json", "-")
    write_json(tmp_path / "found.json", found.to_dict())
    ours = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    theirs = json.loads(done.out)
    assert theirs["parameters"] == ours["parameters"] and theirs["covariance"] == ours["covariance"]
    assert found.summary(80).splitlines()[-1] == done.err.splitlines()[-1]


def test_a_result_tells_tabulates_and_draws_itself(found, axis):
    assert isinstance(found, Result)
    assert "parameters identified" in found.headline
    assert "linear_spring.stiffness" in found.summary(40)
    table = found.to_dataframe().set_index("name")
    assert table.loc["linear_spring.stiffness", "value"] == pytest.approx(200.0, abs=0.01)
    assert list(found.to_dataframe("harmonics")) == []
    with pytest.raises(rh.InputError, match="no table 'estimate'; one of estimates, harmonics"):
        found.to_dataframe("estimate")
    assert found.plot(axis) is axis
    assert [line.get_label() for line in axis.lines] == ["measured", "identified model"]
    with pytest.raises(rh.InputError, match="no periodic forcing is known"):
        found.to_xarray()
    with pytest.raises(rh.InputError, match="no periodic forcing is known"):
        found.plot_transfer_function(0, axis)


def test_a_notebook_shows_intervals_and_no_markup_of_others(found, run):
    shown = found._repr_html_()
    assert "200.0" in shown and "±" in shown and "<table>" in shown
    output = run.record.output
    hostile = Record("<script>", Channel(output.time, output.value, "<b>"))
    assert "<script>" not in hostile._repr_html_() and "&lt;script&gt;" in hostile._repr_html_()


def test_a_record_is_a_table_over_its_common_times(run, axis):
    record = run.record
    table = record.to_dataframe()
    assert isinstance(table, pd.DataFrame) and table.index.name == "time"
    assert list(table) == ["input", "output", "forcing"] and len(table) > 5900
    assert list(record.to_dataframe("channels")["channel"]) == ["input", "output", "forcing"]
    assert record.to_dict()["channels"]["output"]["unit"] == "m"
    record.plot(axis, role="input")
    assert axis.get_ylabel() == "input [N]"
    with pytest.raises(rh.InputError, match="no channel 'velocity'"):
        record.plot(axis, role="velocity")


def test_covariance_agrees_with_the_standard_deviations_and_draws_its_correlation(found, axis):
    covariance = found.covariance
    place = covariance.names.index("linear_spring.stiffness")
    assert covariance.std[place] == pytest.approx(found.parameters["linear_spring.stiffness"].std)
    assert np.diag(covariance.correlation) == pytest.approx(1.0)
    assert covariance.to_dataframe().loc[
        "linear_spring.stiffness", "linear_spring.stiffness"
    ] == pytest.approx(1.0)
    covariance.plot(axis)
    assert [label.get_text() for label in axis.get_yticklabels()] == list(covariance.names)


def test_a_parameter_that_is_not_determined_has_no_correlation():
    made = JointCovariance.of(
        ("a", "b", "c"), ("N", "N", "s"), np.array([[4.0, 1, 3], [1, 1, 2], [3, 2, 1e24]])
    )
    assert made.correlation[0, 1] == pytest.approx(0.5)
    assert made.std[2] == math.inf and np.isnan(made.correlation[2]).all()
    assert made.to_dict()["units"] == ["N", "N", "s"]


def test_transfer_functions_are_labelled_by_harmonic_and_frequency():
    frequency = np.array([1.0, 2.0, 3.0])
    value = np.arange(6).reshape(2, 3) * (1 + 2j)
    made = HarmonicTransferFunctions(np.array([0, 1]), frequency, value, np.ones((2, 3))).to_xarray("m/N")
    assert made["value"].dims == ("harmonic", "frequency") and made["value"].attrs["units"] == "m/N"
    assert made["value"].sel(harmonic=1, frequency=2.0).item() == 4 + 8j
    assert made["std"].dtype == np.float64


def test_what_is_not_installed_is_said_with_what_to_install():
    with pytest.raises(rh.InputError, match=r"to_xarray needs not_there; .*rhythmid\[notebook\]"):
        optional("not_there", "to_xarray")

"""`identify`: estimates, assumptions, and the dictionary that other programs read."""

import json
from dataclasses import replace
from importlib.resources import as_file, files

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.identify.bound import planned_record
from rhythmid.identify.identification import Delays, Estimate, Observables
from rhythmid.identify.identify import _open, identify, paper_hopper, with_delays
from rhythmid.model import Model
from rhythmid.record.signals import Sinusoid


@pytest.fixture(scope="module")
def found(paper_record):
    return identify(paper_record())


def test_the_dictionary_has_the_shape_that_other_programs_rely_on(found) -> None:
    result = json.loads(json.dumps(found.to_dict()))
    assert {"parameters", "delays", "harmonics", "methods", "quality"} <= set(result)
    assert result["parameters"]["linear_spring.stiffness"]["unit"] == "N/m"
    assert {"value", "std", "unit"} == set(result["parameters"]["switched_damper.stance"])
    assert {"input", "measurement", "sum", "separable", "assumption", "closure"} <= set(result["delays"])
    assert set(result["delays"]["input"]) == {"value", "std", "unit"}
    assert set(result["methods"]["paper"]) == {"G0", "G-1", "G+1"}
    assert set(result["methods"]["paper"]["G0"]) == {"sum"}
    assert set(result["methods"]["paper"]["G-1"]) == {"input", "measurement"}
    assert {"rate", "gaps", "jitter_std", "nrmse", "averaged"} <= set(result["quality"])
    for harmonic in result["harmonics"]:
        lengths = {len(harmonic[key]) for key in ("frequency", "magnitude", "phase", "std")}
        assert len(lengths) == 1
    assert [harmonic["m"] for harmonic in result["harmonics"]] == [-3, -2, -1, 0, 1, 2, 3]


def test_the_papers_hopper_is_found_from_the_papers_experiment(found) -> None:
    result = found.to_dict()
    assert result["parameters"]["linear_spring.stiffness"]["value"] == pytest.approx(200.0, rel=1e-3)
    assert result["parameters"]["switched_damper.stance"]["value"] == pytest.approx(2.0, rel=5e-3)
    assert result["delays"]["input"]["value"] == pytest.approx(0.04, abs=0.3e-3)
    assert result["delays"]["measurement"]["value"] == pytest.approx(0.05, abs=0.3e-3)
    assert result["delays"]["separable"] is True
    assert result["quality"]["nrmse"] < 2e-3


def test_the_identified_model_holds_the_estimates_and_can_be_saved(found, tmp_path) -> None:
    found.model.save(tmp_path / "identified.yaml")
    again = Model.load(tmp_path / "identified.yaml")
    assert again.value("input_delay.delay") == pytest.approx(0.04, abs=0.3e-3)
    assert again.value("linear_spring.stiffness") == found.model.value("linear_spring.stiffness")


def test_the_assumption_on_the_forcing_is_stated(found, paper_record) -> None:
    assert "forcing" in found.delays.assumption
    stated = replace(paper_record(), forcing_law=Sinusoid(1.0, 1.0, 0.0))
    assert "stated" in identify(stated, method="paper").delays.assumption


def test_without_forcing_only_the_sum_is_given(paper_record) -> None:
    blind = replace(paper_record(), forcing=None).cut(0.0, 90.0)  # a smooth machine needs no shifted sweeps
    smooth = paper_hopper().with_values({"switched_damper.stance": 1.0, "switched_damper.flight": 1.0})
    delays = identify(blind, smooth, method="paper").delays
    assert delays.separable is False
    assert delays.input.value is None and delays.measurement.value is None
    assert delays.sum.value == pytest.approx(0.09, abs=3e-3)


def test_a_forcing_of_another_phase_changes_nothing(paper_record) -> None:
    delays = identify(paper_record(phase=2.0), method="paper").delays
    assert delays.input.value == pytest.approx(0.04, abs=0.5e-3)
    assert delays.measurement.value == pytest.approx(0.05, abs=0.5e-3)


def test_two_records_of_one_machine_are_averaged(paper_record) -> None:
    both = identify([paper_record(), paper_record(noise=2e-6)], method="paper")
    assert both.delays.sum.value == pytest.approx(0.09, abs=0.1e-3)
    assert len(both.paper) == 2


def test_a_command_that_does_not_repeat_is_noted(paper_record) -> None:
    notes = identify(paper_record(warm_up=0), method="paper").notes
    assert any("does not repeat" in note for note in notes)


def test_outliers_are_left_out_and_told(paper_record) -> None:
    clean = paper_record()
    value = clean.output.value.copy()
    value[1000::5000] += 0.5
    found = identify(replace(clean, output=replace(clean.output, value=value)), method="paper")
    assert found.delays.sum.value == pytest.approx(identify(clean, method="paper").delays.sum.value, abs=1e-5)
    assert sum("stand far off their neighbours" in note for note in found.notes) == 1


def test_delays_are_added_to_a_model_that_has_none() -> None:
    bare = paper_hopper().without("input_delay")
    made = with_delays(bare, 0.01, 0.02)
    assert made.value("input_delay.delay") == 0.01
    assert made.value("measurement_delay.delay") == 0.02


def test_nothing_to_identify_from_is_refused() -> None:
    with pytest.raises(InputError, match="at least one record"):
        identify([])


def test_a_silent_record_is_refused_by_the_papers_method(paper_record) -> None:
    made = paper_record()
    assert made.input is not None
    with pytest.raises(InputError, match="silent"):
        identify(replace(made, input=replace(made.input, value=np.zeros(len(made.input)))), method="paper")


def test_a_record_without_noise_closes_within_the_error_of_discretisation(found) -> None:
    assert abs(found.delays.closure) < 3.0
    for estimate, truth in ((found.delays.input, 0.04), (found.delays.measurement, 0.05)):
        assert abs(estimate.value - truth) < 3.0 * estimate.std


@pytest.mark.parametrize(
    ("gap", "std", "noted"),
    [(4e-6, 1e-7, False), (-4e-6, 1e-7, False), (4e-5, 1e-6, True), (-4e-5, 1e-6, True), (4e-5, 1e-5, False)],
)
def test_a_closure_is_open_beyond_five_deviations_and_a_hundredth_of_a_sample(gap, std, noted) -> None:
    def seconds(value: float) -> Estimate:
        return Estimate(value, std, "s")

    z = gap / std
    seen = Observables(seconds(0.05), seconds(0.09), seconds(0.04 + gap), z)
    delays = Delays(seconds(0.04), seconds(0.05), seconds(0.09), True, "", closure=z, observables=seen)
    assert _open(delays, 1e-3) is noted


def test_a_closure_that_cannot_be_had_is_not_open() -> None:
    nothing = Estimate(None, None, "s")
    assert not _open(Delays(nothing, nothing, nothing, False, ""), 1e-3)


def test_an_excitation_that_misses_sidebands_still_gives_both_delays_by_maximum_likelihood() -> None:
    """Two lines, too few to read the phase of a sideband as the paper does."""
    text = """
model: paper_hopper.yaml
excitation: {type: multisine, rms: 0.004, period: 1.0, lines: [1, 3], periods: 16}
forcing: {amplitude: 1.0, frequency: 2.0}
delays: {input: 0.04, measurement: 0.05}
"""
    with as_file(files("rhythmid") / "models") as folder:
        found = identify(planned_record(Experiment.from_text(text, folder)))
    assert found.delays.input.value == pytest.approx(0.04, abs=1e-4)
    assert found.delays.measurement.value == pytest.approx(0.05, abs=1e-4)
    assert set(found.paper[0].delays) < {-1, 0, 1}

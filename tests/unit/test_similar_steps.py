"""Descents of structures that share parameters: steps that are known by name are not sought again."""

import numpy as np
import pytest

from machines import CATALOGUE, SHORT, hopper, records
from rhythmid.diagnose.search.trial import steps_by_name
from rhythmid.identify.descent import WHITE, descend, first_guess
from rhythmid.identify.free_run import FreeRun, prepare_run
from rhythmid.identify.series import prepare

RECORDS = records(hopper(), SHORT[:1])


@pytest.fixture
def simulations(monkeypatch) -> list[float]:
    """Grows by one entry for each simulation."""
    made: list[float] = []
    outputs = FreeRun.outputs

    def counted(self, *given):
        made.append(1.0)
        return outputs(self, *given)

    monkeypatch.setattr(FreeRun, "outputs", counted)
    return made


def test_steps_of_a_similar_structure_save_simulations_and_lead_to_the_same_minimum(simulations):
    plain = hopper().with_values({"linear_spring.stiffness": 230.0})
    run = prepare_run(plain, prepare(RECORDS))
    end = descend(plain, run, tuple(plain.free), WHITE, first_guess(plain, run))
    known = steps_by_name(end.model, run.compiled.layout.states, end.differences)
    richer = end.model.with_element(CATALOGUE["cubic_stiffness"], {"coefficient": 100.0})
    wider = prepare_run(richer, run.series)
    found, counts = [], []
    for similar in ({}, known):
        simulations.clear()
        names = tuple(richer.free)
        found.append(descend(richer, wider, names, WHITE, first_guess(richer, wider), similar=similar))
        counts.append(len(simulations))
    assert counts[1] < counts[0] - len(plain.free)
    assert found[1].chi2 == pytest.approx(found[0].chi2, rel=1e-3)


def test_steps_are_named_and_those_of_what_has_moved_are_left_out():
    model = hopper()
    run = prepare_run(model, prepare(RECORDS))
    steps = np.arange(float(len(model.free))), np.array([7.0, 8.0])
    named = steps_by_name(model, run.compiled.layout.states, steps, without=model.free[:1])
    assert set(named) == {*model.free[1:], *run.compiled.layout.states}
    assert named[model.free[1]] == 1.0 and [named[name] for name in run.compiled.layout.states] == [7.0, 8.0]

"""The time for an answer is shared among the joints of a machine."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from legged import TWO_LINKS, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.diagnose.case import SEARCHED, Budget
from rhythmid.diagnose.joints import joint_diagnosis
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.errors import InputError

PATH = "{command: [{position_control: {proportional: 80, derivative: 2}}], force: [{viscous_damper: {damping: 0.1}}]}"


def test_each_joint_has_its_part_of_the_time_that_those_before_it_have_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "two.urdf").write_text(TWO_LINKS)
    (tmp_path / "two.yaml").write_text(
        f"body: {{urdf: two.urdf, contacts: false}}\njoints:\n  one: {PATH}\n  two: {PATH}\n"
    )
    machine = Machine.load(tmp_path / "two.yaml")
    time, rng = np.arange(0.0, 3.0, 0.002), np.random.default_rng(4)
    asked = references({"one": (0.5, 0.4), "two": (0.7, 0.4)}, time, rng, (0.3, 2.0))
    parts: list[float | None] = []

    def at_once(_: Any, __: Any, joint: str, ___: Any, ____: Any, budget: Budget, *_____: Any) -> None:
        parts.append(budget.seconds)
        raise InputError(joint)

    monkeypatch.setattr(joint_diagnosis, "diagnose_joint", at_once)
    with pytest.raises(InputError):
        diagnose_machine([recorded(machine, asked, time, rng)], machine, budget=1000.0)
    whole = SEARCHED * 1000.0
    assert parts == [pytest.approx(whole / 2, rel=0.05), pytest.approx(whole, rel=0.05)]


def test_parts_of_no_limit_have_none_and_parts_of_a_spent_budget_no_time():
    assert Budget().part(SEARCHED, 3).seconds is None
    assert Budget(10.0, began=-1e9).part(SEARCHED, 3).seconds == 0.0

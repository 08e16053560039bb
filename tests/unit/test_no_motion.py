"""Where no name says a motion, the refusal lists what was recorded, and what it writes down for one of the columns can be read."""

import re
from pathlib import Path

import numpy as np
import pytest

import rhythmid
from rhythmid.errors import InputError
from rhythmid.start.start import guess

TIME = 0.002 * np.arange(1000)


def test_a_table_without_a_name_of_a_motion_is_refused_with_its_columns_and_how_to_name_one(
    tmp_path: Path,
) -> None:
    path = tmp_path / "run.csv"
    speed = np.sin(5.0 * TIME)
    columns = np.column_stack([TIME, speed, np.sign(speed), np.cos(TIME)])
    np.savetxt(path, columns, delimiter=",", header="TIMESTAMP,CURRENT_M1,PWM_M1,PWM_M2", comments="")
    with pytest.raises(InputError) as refused:
        guess(path)
    said = str(refused.value)
    assert "CURRENT_M1 (effort: its name says 'current')" in said and "PWM_M2 (effort" in said
    assert "at present" in said and "\n" not in said
    (line,) = re.findall(r"output: \{.*\}", said)
    signals = tmp_path / "signals.yaml"
    signals.write_text(f"time: {{column: TIMESTAMP}}\n{line}\ninput: none\n")
    assert rhythmid.load(path, signals).output_kind == "velocity"

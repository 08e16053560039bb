"""Records of a free motion whose encoder was zeroed before each are told, and brought to one zero."""

from pathlib import Path

import numpy as np
import pytest

from rhythmid.errors import InputError
from rhythmid.record.load import load
from rhythmid.record.read import read_record
from rhythmid.record.signals import Signals
from rhythmid.start.start import start

TIME = np.arange(0.0, 12.0, 0.01)


def swing(release: float) -> np.ndarray:
    """Angle (n,) of a pendulum that is released at rest, from where it hangs."""
    angle, speed, found = release, 0.0, []
    for _ in TIME:
        found.append(angle)
        for _ in range(4):
            speed -= 0.0025 * (30.0 * np.sin(angle) + 0.1 * speed)
            angle += 0.0025 * speed
    return np.array(found)


def written(folder: Path, name: str, angle: np.ndarray) -> Path:
    noise = 1e-3 * np.random.default_rng(len(name)).standard_normal(len(angle))
    path = folder / f"{name}.npz"
    np.savez(path, **{"t [s]": TIME, "angle [rad]": angle + noise})
    return path


def test_a_pendulum_that_is_zeroed_before_each_record_has_one_zero_and_gravity(tmp_path):
    both = [written(tmp_path, "left", swing(1.2) - 1.6), written(tmp_path, "right", swing(-0.9) + 1.55)]
    found = start(both)
    assert found.nominal.model.value("pendulum_gravity.moment") == pytest.approx(30.0, rel=0.1)
    assert "the records rest at different places, right by 3.15 rad" in " ".join(found.lines())
    signals = Signals.from_text(found.signals, tmp_path / "signals.yaml")
    hanging = found.nominal.model.value("pendulum_gravity.reference")
    for path in both:
        assert float(np.mean(load(path, signals).output.value[-400:])) == pytest.approx(hanging, abs=0.05)


def test_records_with_one_zero_keep_it(tmp_path):
    found = start([written(tmp_path, "left", swing(1.2)), written(tmp_path, "right", swing(-0.9))])
    assert "pendulum_gravity" in found.nominal.reasons
    assert "offset" not in found.signals


def test_a_record_without_an_offset_of_its_own_is_refused(tmp_path):
    path = written(tmp_path, "third", swing(0.5))
    text = 'time: {column: "t [s]"}\noutput: {column: "angle [rad]", unit: rad, offset: {left: 0, right: -3.15}}\n'
    with pytest.raises(InputError, match="offset: has no value for 'third', only for left, right"):
        read_record(path, Signals.from_text(text, tmp_path / "signals.yaml"))

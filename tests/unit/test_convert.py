"""A table that became a bag is the same record."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhythmid.errors import InputError
from rhythmid.record.convert import write_record
from rhythmid.record.read import read_record
from rhythmid.record.record import Channel, Record
from rhythmid.record.signals import Sinusoid

N = 50


def array(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(N)


@st.composite
def records(draw):
    """Records with any of the optional channels, even or uneven times, one for all or their own."""
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    rate, start = draw(st.sampled_from([50.0, 610.3515625, 1000.0])), draw(st.sampled_from([0.0, 0.5, 8.0]))
    uneven = draw(st.booleans())
    base = start + (np.arange(N) + uneven * rng.uniform(0.0, 0.4, N)) / rate

    def channel(unit: str) -> Channel:
        late = draw(st.booleans()) * 0.1 / rate
        return Channel(base + late, rng.standard_normal(N), unit)

    roles = {"forcing": "N*m", "velocity": "rad/s", "effort": "N*m", "reference": "rad"}
    found = {role: channel(unit) for role, unit in roles.items() if draw(st.booleans())}
    kind = draw(st.sampled_from(["force", "base_displacement", "reference", None]))
    if kind is not None:
        found["input"] = channel("N*m" if kind == "force" else "rad")
    measured = draw(st.sampled_from(["position", "velocity"]))
    if measured == "velocity":
        found.pop("velocity", None)
    output = Channel(base, rng.standard_normal(N), "rad" if measured == "position" else "rad/s")
    return Record(
        "a run", output, **found, input_kind=kind or "force", output_kind=measured,
        hold=draw(st.sampled_from(["zero", "linear"])), parameters=draw(st.sampled_from([{}, {"a.b": 2.5}])),
    )  # fmt: skip


@given(records())
def test_the_bag_reads_back_to_the_same_record(tmp_path_factory, record):
    path = tmp_path_factory.mktemp("convert") / "bag"
    write_record(record, path)
    found = read_record(path, path / "signals.yaml")
    assert found.channels.keys() == record.channels.keys()
    for role, channel in record.channels.items():
        np.testing.assert_array_equal(found.channels[role].value, channel.value)
        np.testing.assert_allclose(found.channels[role].time, channel.time, rtol=0.0, atol=1e-9)
        assert found.channels[role].unit == channel.unit
    assert found.output_kind == record.output_kind and found.parameters == record.parameters
    if record.input is not None:
        assert (found.input_kind, found.hold) == (record.input_kind, record.hold)


@pytest.mark.parametrize("start", [-3.0, 1000.0])
def test_times_that_no_bag_keeps_are_counted_from_the_first_and_a_formula_with_them(tmp_path, start):
    time = start + np.arange(N) * 0.02
    law = Sinusoid(2.0, 1.3, 0.4)
    record = Record(
        "run", Channel(time, array(0), "m"), forcing_law=law, forcing=Channel(time, law(time), "N")
    )
    write_record(record, tmp_path / "bag")
    found = read_record(tmp_path / "bag", tmp_path / "bag" / "signals.yaml")
    np.testing.assert_allclose(found.output.time, time - start, atol=1e-9)
    assert found.forcing_law is not None
    np.testing.assert_allclose(found.forcing_law(found.output.time), law(time), atol=1e-9)


def test_an_acceleration_is_refused_and_nothing_written(tmp_path):
    time = np.arange(N) * 0.02
    record = Record("run", Channel(time, array(0), "m/s^2"), output_kind="acceleration")
    with pytest.raises(InputError, match="output is an acceleration, which a JointState does not hold"):
        write_record(record, tmp_path / "bag")
    assert not (tmp_path / "bag").exists()

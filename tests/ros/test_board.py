"""The board of `rhythmid watch`: mismatch, delays, rates and lateness stand on terminals of 80 and of 40 columns."""

import io

import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rich.console import Console

from rhythmid_bringup.board import drawn

MODEL = {
    "mismatch [threshold]": "1.84", "innovation rms [1]": "1.31", "delay input [s]": "0.0403", "delay input std [s]": "0.0004",
    "delay measurement [s]": "0.0507", "share sensor [1]": "0.93", "diagnosis names": "measurement_delay, coulomb_friction",
}  # fmt: skip
TWIN = {
    "/hopper/joint_states rate [Hz]": "999.8", "/hopper/joint_states lateness p99 [ms]": "0.4200",
    "/hopper/joint_states lateness max [ms]": "65.0123", "/hopper/joint_states lost": "3", "samples refused": "0",
}  # fmt: skip
PLANT = {
    "rate_hz": "1000.000", "lateness_p99_ms": "0.2100", "lateness_max_ms": "4.1000", "transport_p99_ms": "0.9000",
    "transport_max_ms": "19.8195", "late_commands": "1129", "path": "a" * 60,
}  # fmt: skip


def status(name: str, level: bytes, message: str, values: dict[str, str]) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(name=f"rhythmid: {name}", level=level, message=message, values=pairs)


@pytest.fixture
def newest() -> dict[str, DiagnosticStatus]:
    all_of_them = [
        status("hopper/twin", DiagnosticStatus.OK, "ok", TWIN),
        status(
            "hopper/twin/model",
            DiagnosticStatus.WARN,
            "the machine has left its model from 40.1 s: in sensor",
            MODEL,
        ),
        status("hopper/plant", DiagnosticStatus.WARN, "not ready: no publisher of /hopper/command", PLANT),
    ]
    return {one.name: one for one in all_of_them}


def shown(newest: dict[str, DiagnosticStatus], columns: int) -> list[str]:
    console = Console(file=io.StringIO(), width=columns)
    console.print(drawn(newest))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue().splitlines()


@pytest.mark.parametrize("columns", [40, 80])
def test_mismatch_delays_rates_and_lateness_are_whole_on_a_terminal_of_24_lines(newest, columns):
    lines = shown(newest, columns)
    assert len(lines) <= 24 and max(map(len, lines)) <= columns
    text = "".join("".join(lines).split())
    assert "…" not in text
    for value in (
        "1.84",
        "0.0403",
        "0.0507",
        "0.93",
        "measurement_delay,",
        "999.8",
        "0.42",
        "65",
        "0.9",
        "19.8",
        "1129",
    ):
        assert value in text, value
    assert "themachinehasleftitsmodelfrom40.1s:insensor" in text and "/hopper/" in text


def test_the_model_comes_first_and_nothing_is_waited_for_in_one_line(newest):
    assert "twin/model" in shown(newest, 80)[0]
    assert shown({}, 80) == ["waiting for the twin"]

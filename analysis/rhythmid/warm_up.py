"""Compile in advance the code for the first simulation, identification and diagnosis of the paper's hopper; used by `make install`.

    python -m rhythmid.warm_up

A short run of each uses the same code as a user's call, so that no list of functions is needed. The machine code is
cached (see `rhythmid.simulation.machine_code.cache_folder`); a second warm-up takes some seconds.
"""

import sys
import time
from collections.abc import Callable
from importlib.resources import files

import numpy as np

from rhythmid.errors import InputError
from rhythmid.experiment import Experiment
from rhythmid.offline_run import perform
from rhythmid.parallel import fork_map
from rhythmid.record.record import Channel, Record
from rhythmid.simulation.machine_code import cache_folder

EXPERIMENT = """
model: paper_hopper.yaml
excitation: {type: chirp, amplitude: 0.3, band: [0, 7], sweep: 12.0}
delays: {input: 0.04, measurement: 0.05}
noise: {measurement_std: 1.0e-5}
"""


def short_record() -> Record:
    """Twelve seconds of the hopper, simulated."""
    topics = perform(Experiment.from_text(EXPERIMENT, str(files("rhythmid") / "models")))

    def channel(topic: str, field: str, unit: str) -> Channel:
        time = np.asarray(topics[topic].stamp_ns * 1e-9, dtype=np.float64)
        return Channel(time, getattr(topics[topic], field), unit)

    return Record(
        "warm-up",
        channel("joint_states", "position", "m"),
        channel("excitation", "effort", "N"),
        channel("forcing", "effort", "N"),
    )


def _identify(record: Record) -> None:
    from rhythmid.identify.identify import identify

    identify([record])


def _diagnose(record: Record) -> None:
    from rhythmid.diagnose.diagnosis import diagnose
    from rhythmid.identify.identify import paper_hopper

    diagnose([record], paper_hopper())


def main() -> None:
    """Warm up, and report it in one line."""
    print("compiling the standard models, once ...", end=" ", flush=True)
    started = time.monotonic()
    try:
        record = short_record()
        tasks: list[Callable[[Record], None]] = [_diagnose, _identify]
        for _, done in fork_map(lambda task: task(record), tasks):
            if isinstance(done, Exception):
                raise done
    except InputError as error:
        sys.exit(f"not done: {error}")
    print(f"{time.monotonic() - started:.0f} s; kept in {cache_folder()}")


if __name__ == "__main__":
    main()

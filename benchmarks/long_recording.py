"""A long recording in a short time: memory of the live bag while hours of messages are written.

python benchmarks/long_recording.py [HOURS [RATE [SPLIT]]]

RATE [Hz] is that of all topics together; SPLIT is the time [s] after which the next file is begun, 0 for one file. The disk
needs 99 bytes a message: 14 GB for ten hours at 4 kHz.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

from rhythmid.record.bag import Bag
from rhythmid_nodes.bag import LiveBag, Storage
from rhythmid_nodes.joint_state import JointStateWriter

TOPICS = ("/excitation", "/command", "/forcing", "/joint_states")
WAITING = 20_000  # messages in the queue above which the sender waits for the disk
REPORTS = 10


def resident() -> float:
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() * 1e-6


def record(path: Path, seconds: float, rate: float, split: float) -> list[float]:
    """Record so much simulated time; returns the memory [MB] after each tenth of it."""
    bag = LiveBag(Storage(path, max_duration=split, by_message_time=True))
    bag.open()
    for topic in TOPICS:
        bag.add_topic(topic, "sensor_msgs/msg/JointState", [])
    write = JointStateWriter("leg", "effort").write
    count, found = int(seconds * rate), []
    for number in range(count):
        stamp_ns = int(number // len(TOPICS) * len(TOPICS) / rate * 1e9)
        bag.put(TOPICS[number % len(TOPICS)], stamp_ns, write(stamp_ns, float(number)))
        if number % 1000 == 0:
            while len(bag) > WAITING:
                time.sleep(0.001)
        if (number + 1) % (count // REPORTS) == 0:
            found.append(resident())
    bag.stop()
    if bag.failure is not None:
        raise bag.failure
    return found


def main() -> None:
    hours, rate, split = (
        float(given) for given in (*sys.argv[1:], *("10", "4000", "0")[len(sys.argv) - 1 :])
    )
    with tempfile.TemporaryDirectory() as folder:
        begun = time.monotonic()
        memory = record(Path(folder) / "bag", hours * 3600, rate, split)
        elapsed = time.monotonic() - begun
        bag = Bag(Path(folder) / "bag")
        size = sum(file.stat().st_size for file in bag.files)
        messages = sum(bag.stated.values())
    print(
        f"{hours:g} h at {rate:g} Hz in {elapsed:.0f} s: {messages} messages, {size * 1e-9:.2f} GB in {len(bag.files)} "
        f"files; memory after each tenth [MB]: {', '.join(f'{value:.0f}' for value in memory)}"
    )


if __name__ == "__main__":
    main()

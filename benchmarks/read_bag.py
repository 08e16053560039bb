"""Reading a bag into arrays, by layout and by rosbags' deserialiser, side by side: messages per second of CPU time.

python benchmarks/read_bag.py
"""

import tempfile
import time
from pathlib import Path

import numpy as np

from rhythmid.record.bag import Bag
from rhythmid.record.bag_writer import write_bag
from rhythmid.record.columns import read_columns
from rhythmid.record.field import Field
from rhythmid.record.messages import Messages

COUNT = 270_000


def main() -> None:
    stamps = np.arange(COUNT, dtype=np.int64) * 1_000_000
    value = np.random.default_rng(0).standard_normal(COUNT)
    topics = {
        "/hopper/excitation": Messages(stamps, effort=value),
        "/hopper/forcing": Messages(stamps, effort=value),
        "/hopper/command": Messages(stamps, effort=value),
        "/hopper/joint_states": Messages(stamps, position=value, velocity=value, effort=value),
    }
    wanted = {name: [Field.parse("position[leg]" if "states" in name else "effort[leg]")] for name in topics}
    with tempfile.TemporaryDirectory() as folder:
        for storage in ("mcap", "sqlite3"):
            path = Path(folder) / storage
            write_bag(path, topics, storage=storage)
            rates = {}
            for direct in (True, False, True):
                begin = time.process_time()
                read_columns(Bag(path).blocks(lambda topic: topic.name in wanted), wanted, direct=direct)
                rates[direct] = len(topics) * COUNT / (time.process_time() - begin)
            print(
                f"{storage}: {rates[True]:,.0f} messages per CPU-second by layout, {rates[False]:,.0f} one by one, "
                f"ratio {rates[True] / rates[False]:.1f}"
            )


if __name__ == "__main__":
    main()

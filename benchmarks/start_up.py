"""How long the command and the package take to start, warm.

    python benchmarks/start_up.py [RUNS]

prints the minimum and the median wall-clock and processor seconds of each process, compared with an empty Python.
"""

import resource
import statistics
import subprocess
import sys
import time

PROCESSES = {
    "rhythmid --help": ["-m", "rhythmid", "--help"],
    "import rhythmid": ["-c", "import rhythmid"],
    "python -c pass": ["-c", "pass"],
}


def spent() -> float:
    """Processor seconds of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measured(arguments: list[str], runs: int) -> tuple[list[float], list[float]]:
    """Wall-clock and processor seconds of each of `runs` processes, after one that does not count."""
    wall, processor = [], []
    for run in range(runs + 1):
        began, before = time.perf_counter(), spent()
        subprocess.run([sys.executable, *arguments], stdout=subprocess.DEVNULL, check=True)
        if run:
            wall.append(time.perf_counter() - began)
            processor.append(spent() - before)
    return wall, processor


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    for name, words in PROCESSES.items():
        seconds = (f"{min(one):.3f}, {statistics.median(one):.3f}" for one in measured(words, count))
        print(f"{name:16} wall {next(seconds)} s   processor {next(seconds)} s   (least, median of {count})")

"""What executes the tasks of a batch: processes on this computer, or an existing Dask cluster."""

from collections.abc import Iterator, Sequence
from itertools import islice

from rhythmid.batch.answered import Answered, answer, failed
from rhythmid.batch.task import Task
from rhythmid.errors import InputError
from rhythmid.parallel import fork_each

AHEAD = 2  # tasks that are submitted at once per thread of the cluster: one running, one waiting
CONNECT = "10s"  # timeout for the answer of a scheduler

Answers = Iterator[tuple[Task, Answered]]


def by_processes(tasks: Sequence[Task], jobs: int | None = None) -> Answers:
    """Answers as they come, from `jobs` processes at a time, as many as there are processors by default."""
    for index, found in fork_each(answer, tasks, jobs):
        yield tasks[index], failed(str(found)) if isinstance(found, Exception) else found


def by_cluster(tasks: Sequence[Task], address: str) -> Answers:
    """Answers as they come, from the workers of the Dask scheduler at `address`; they must see the recordings under the same paths.

    Tasks are submitted a few at a time, so that answers accumulate neither in the scheduler nor in this process. If a worker dies, its
    task goes to another one.

    Raises InputError where Dask is not installed, or no scheduler or no worker is there.
    """
    try:
        from distributed import Client, as_completed
    except ModuleNotFoundError as missing:
        if missing.name != "distributed":
            raise
        raise InputError("--scheduler needs Dask; install it with: pip install 'rhythmid[batch]'") from None
    try:
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"--scheduler {address}: no Dask scheduler answers: {reason}") from None
    with client, client.as_current():
        threads = sum(one["nthreads"] for one in client.scheduler_info(n_workers=-1)["workers"].values())
        if not threads:
            raise InputError(
                f"--scheduler {address}: the scheduler has no workers; start some with: dask worker {address}"
            )
        waiting = iter(tasks)
        running = {
            client.submit(answer, task, key=f"rhythmid-{task.key}", pure=False): task
            for task in islice(waiting, AHEAD * threads)
        }
        done = as_completed(list(running))
        for future in done:
            task, error = running.pop(future), future.exception()
            found = failed(f"{type(error).__name__}: {error}") if error is not None else future.result()
            future.release()
            for following in islice(waiting, 1):
                added = client.submit(answer, following, key=f"rhythmid-{following.key}", pure=False)
                running[added] = following
                done.add(added)
            yield task, found

"""Map a function over items in forked worker processes.

Compiling and fitting a model hold the interpreter lock, so threads would take turns. A fork hands the items over as they
are: nothing but the results is pickled. Where the system cannot fork, the items are worked through one after another.
"""

import gc
import multiprocessing
import multiprocessing.connection
import os
import pickle
import signal
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from rhythmid.errors import InputError
from rhythmid.freed_memory import give_back

Item = TypeVar("Item")
Result = TypeVar("Result")
AHEAD = 2  # results for each processor that wait to be taken: one more than keeps it busy, for they take unequal times


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


@contextmanager
def _interrupted_afterwards() -> Iterator[None]:
    """Within this, Ctrl-C is put off to the end: what its handler raises among the callbacks of a fork, Python prints and forgets."""
    usual = signal.getsignal(signal.SIGINT)
    if usual is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
        if came:
            signal.raise_signal(signal.SIGINT)


def _work(function: Callable[[Any], Any], items: Sequence[Any], own: Iterable[int], pipe: Any) -> None:
    # What was inherited is not this process's to collect: going through it would copy the parent's memory, and may
    # meet frames of threads that exist in the parent only.
    gc.freeze()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who interrupts means the parent, which ends its workers
    for index in own:
        try:
            answer = (index, function(items[index]), None)
        except InputError as error:
            answer = (index, None, error)
        except BaseException:
            answer = (index, None, RuntimeError(traceback.format_exc()))
        give_back()  # while it waits, and before what the next item needs
        try:
            pipe.send(answer)
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            pipe.send((index, None, RuntimeError(f"a worker's result cannot be sent back: {error}")))
    pipe.close()


def each(
    function: Callable[[Item], Result], items: Iterable[Item], pool: ThreadPoolExecutor | None = None
) -> Iterator[Result]:
    """Results in the order of the items, made in the pool's threads a few ahead of who takes them: neither items nor results gather."""
    if pool is None:
        yield from map(function, items)
        return
    waiting: deque[Future[Result]] = deque()
    for item in items:
        waiting.append(pool.submit(function, item))
        if len(waiting) > AHEAD * cores():
            yield waiting.popleft().result()
    while waiting:
        yield waiting.popleft().result()


def fork_map(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int | None = None
) -> Iterator[tuple[int, Result | Exception]]:
    """Results as they come, each with the index of its item. InputErrors are results; any other failure is raised.

    The rest of a worker that is killed, by a lack of memory for instance, goes to a new one; RuntimeError is raised
    where the same item takes that one, too.
    """
    count = min(workers or cores(), len(items))
    within = multiprocessing.current_process().daemon  # a worker, which may have none of its own
    if count <= 1 or within or "fork" not in multiprocessing.get_all_start_methods():
        for index, item in enumerate(items):
            try:
                yield index, function(item)
            except InputError as error:
                yield index, error
        return
    context = multiprocessing.get_context("fork")
    running: dict[Any, tuple[Any, list[int]]] = {}
    fatal: set[int] = set()  # items at which a worker was killed

    def start(own: list[int]) -> None:
        receive, send = context.Pipe(duplex=False)
        process = context.Process(target=_work, args=(function, items, tuple(own), send), daemon=True)
        with _interrupted_afterwards():
            process.start()
            running[receive] = (process, own)
        send.close()

    give_back()
    try:
        for worker in range(count):
            start(list(range(worker, len(items), count)))
        while running:
            ready = multiprocessing.connection.wait(list(running))
            for pipe in [one for one in running if one in ready]:
                process, left = running[pipe]
                try:
                    index, result, error = pipe.recv()
                except (EOFError, OSError):  # nothing more, or killed amid an answer
                    process.join()
                    del running[pipe]
                    if left and left[0] in fatal:
                        raise RuntimeError(
                            f"two workers died at the same work, exit code {process.exitcode}"
                        ) from None
                    if left:
                        fatal.add(left[0])
                        start(left)
                    continue
                left.remove(index)
                if error is not None and not isinstance(error, InputError):
                    raise error
                yield index, error if error is not None else result
    finally:
        for process, _ in running.values():
            process.terminate()


def fork_each(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int | None = None, lifetime: int = 8
) -> Iterator[tuple[int, Result | Exception]]:
    """As `fork_map`, for items that take long and must not harm one another; every failure is a result.

    Whoever is free takes the next item. A process ends after `lifetime` items, which gives back what memory has gathered. An item whose
    process is killed is tried once more; a RuntimeError that tells the signal is its result where that process is killed, too.
    """
    if multiprocessing.current_process().daemon or "fork" not in multiprocessing.get_all_start_methods():
        yield from fork_map(function, items, 1)
        return
    context = multiprocessing.get_context("fork")
    waiting, tried = deque(range(len(items))), set[int]()
    running: dict[
        Any, tuple[Any, int, int]
    ] = {}  # its process, the item at hand, items that it may still take

    def start() -> None:
        ours, theirs = context.Pipe()
        given: Iterator[int] = iter(theirs.recv, None)
        process = context.Process(target=_work, args=(function, items, given, theirs), daemon=True)
        with _interrupted_afterwards():
            process.start()
            theirs.close()
            hand_on(ours, process, lifetime)

    def hand_on(pipe: Any, process: Any, left: int) -> None:
        if waiting and left:
            running[pipe] = (process, waiting.popleft(), left - 1)
            with suppress(OSError):  # killed while idle: seen when it is listened to
                pipe.send(running[pipe][1])
            return
        with suppress(OSError):
            pipe.send(None)
        process.join()
        pipe.close()

    try:
        while waiting or running:
            while waiting and len(running) < (workers or cores()):
                start()
            ready = multiprocessing.connection.wait(list(running))
            for pipe in [one for one in running if one in ready]:
                process, index, left = running.pop(pipe)
                try:
                    _, result, error = pipe.recv()
                except (EOFError, OSError):  # killed
                    process.join()
                    pipe.close()
                    if index not in tried:
                        tried.add(index)
                        waiting.appendleft(index)
                        continue
                    yield index, RuntimeError(f"its process was killed twice, exit code {process.exitcode}")
                    continue
                hand_on(pipe, process, left)
                yield index, result if error is None else error
    finally:
        for process, *_ in running.values():
            process.terminate()

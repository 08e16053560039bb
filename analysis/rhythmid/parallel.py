"""Map a function over items in forked worker processes.

Compiling and fitting a model hold the interpreter lock, so threads would not run in parallel. A fork passes the items as they
are; only the results are pickled. If the system cannot fork, the items are processed one after another.
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
AHEAD = 2  # waiting results per processor: one more than keeps it busy, because items take unequal times


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


@contextmanager
def _interrupted_afterwards() -> Iterator[None]:
    """Within this block, Ctrl-C is deferred to the end, because Python only prints exceptions that are raised in the callbacks of a fork."""
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


def _work(
    function: Callable[[Any], Any],
    items: Sequence[Any],
    own: Iterable[int],
    pipe: Any,
    inherited: Iterable[Any],
) -> None:
    """Answer for the `own` items, until the parent has gone."""
    for one in inherited:  # the parent's ends of pipes; were they open here, its death would not show
        one.close()
    with suppress(EOFError, BrokenPipeError):
        _answer(function, items, own, pipe)
    pipe.close()


def _answer(function: Callable[[Any], Any], items: Sequence[Any], own: Iterable[int], pipe: Any) -> None:
    # What was inherited is not this process's to collect: going through it would copy the parent's memory, and may
    # meet frames of threads that exist in the parent only.
    gc.freeze()
    # an interruption is meant for the parent, which ends its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
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


def each(
    function: Callable[[Item], Result], items: Iterable[Item], pool: ThreadPoolExecutor | None = None
) -> Iterator[Result]:
    """Results in the order of the items, computed in the pool's threads a few ahead of the consumer, so that neither items nor results accumulate."""
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


def _can_fork() -> bool:
    """Whether this process may start workers: the system can fork, and this is not a worker itself."""
    return "fork" in multiprocessing.get_all_start_methods() and not multiprocessing.current_process().daemon


def _ready(running: Iterable[Any]) -> list[Any]:
    """Wait until there is an answer; the pipes with one, in the order of their workers."""
    ready = multiprocessing.connection.wait(list(running))
    return [pipe for pipe in running if pipe in ready]


def fork_map(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int | None = None
) -> Iterator[tuple[int, Result | Exception]]:
    """Results as they are finished, each with the index of its item. InputErrors are results; any other failure is raised.

    If a worker is killed, for example by a lack of memory, a new one takes its remaining items. RuntimeError is raised
    if the same item kills that one, too.
    """
    count = min(workers or cores(), len(items))
    if count <= 1 or not _can_fork():
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
        process = context.Process(
            target=_work, args=(function, items, tuple(own), send, (receive, *running)), daemon=True
        )
        with _interrupted_afterwards():
            process.start()
            running[receive] = (process, own)
        send.close()

    give_back()
    try:
        for worker in range(count):
            start(list(range(worker, len(items), count)))
        while running:
            for pipe in _ready(running):
                process, left = running[pipe]
                try:
                    index, result, error = pipe.recv()
                except (EOFError, OSError):  # finished, or killed during an answer
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
    """As `fork_map`, for long items that must not affect one another; every failure is a result.

    A free process takes the next item. A process ends after `lifetime` items, which frees its memory. An item whose
    process is killed is tried once more. If that process is killed, too, the result is a RuntimeError that names the signal.
    """
    if not _can_fork():
        yield from fork_map(function, items, 1)
        return
    context = multiprocessing.get_context("fork")
    waiting, tried = deque(range(len(items))), set[int]()
    # by pipe: its process, the item at hand, items that it may still take
    running: dict[Any, tuple[Any, int, int]] = {}

    def start() -> None:
        ours, theirs = context.Pipe()
        given: Iterator[int] = iter(theirs.recv, None)
        process = context.Process(
            target=_work, args=(function, items, given, theirs, (ours, *running)), daemon=True
        )
        with _interrupted_afterwards():
            process.start()
            theirs.close()
            hand_on(ours, process, lifetime)

    def hand_on(pipe: Any, process: Any, left: int) -> None:
        if waiting and left:
            running[pipe] = (process, waiting.popleft(), left - 1)
            with suppress(OSError):  # killed while idle, which shows when its answer is read
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
            for pipe in _ready(running):
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

"""Map a function over items in forked worker processes.

Compiling and fitting a model hold the interpreter lock, so threads would take turns. A fork hands the items over as they
are: nothing but the results is pickled. Where the system cannot fork, the items are worked through one after another.
"""

import multiprocessing
import multiprocessing.connection
import os
import pickle
import traceback
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from rhythmid.errors import InputError

Item = TypeVar("Item")
Result = TypeVar("Result")


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def _work(function: Callable[[Any], Any], items: Sequence[Any], own: Sequence[int], pipe: Any) -> None:
    for index in own:
        try:
            answer = (index, function(items[index]), None)
        except InputError as error:
            answer = (index, None, error)
        except BaseException:
            answer = (index, None, RuntimeError(traceback.format_exc()))
        try:
            pipe.send(answer)
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            pipe.send((index, None, RuntimeError(f"a worker's result cannot be sent back: {error}")))
    pipe.close()


def fork_map(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int | None = None
) -> Iterator[tuple[int, Result | Exception]]:
    """Results as they come, each with the index of its item. InputErrors are results; any other failure is raised."""
    count = min(workers or cores(), len(items))
    if count <= 1 or "fork" not in multiprocessing.get_all_start_methods():
        for index, item in enumerate(items):
            try:
                yield index, function(item)
            except InputError as error:
                yield index, error
        return
    context = multiprocessing.get_context("fork")
    running = {}
    for worker in range(count):
        receive, send = context.Pipe(duplex=False)
        own = range(worker, len(items), count)
        process = context.Process(target=_work, args=(function, items, own, send), daemon=True)
        process.start()
        send.close()
        running[receive] = (process, set(own))
    try:
        while running:
            ready = multiprocessing.connection.wait(list(running))
            for pipe in [one for one in running if one in ready]:
                process, left = running[pipe]
                try:
                    index, result, error = pipe.recv()
                except EOFError:
                    process.join()
                    del running[pipe]
                    if left:
                        raise RuntimeError(f"a worker died with exit code {process.exitcode}") from None
                    continue
                left.discard(index)
                if error is not None and not isinstance(error, InputError):
                    raise error
                yield index, error if error is not None else result
    finally:
        for process, _ in running.values():
            process.terminate()

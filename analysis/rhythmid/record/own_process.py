"""A call in a process of its own, for readers in machine code that trust their file: a damaged one may kill the process."""

import multiprocessing
import resource
from collections.abc import Callable
from typing import Any, TypeVar

from rhythmid.errors import InputError

Result = TypeVar("Result")


def in_own_process(call: Callable[[], Result], problem: str) -> Result:
    """Result of `call`, made in a fork of this process; its exceptions are raised here.

    Raises InputError, beginning with `problem`, where the process dies of it. Where the system cannot fork, the call is made here.
    """
    if "fork" not in multiprocessing.get_all_start_methods():
        return call()
    context = multiprocessing.get_context("fork")
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(call, send), daemon=True)
    process.start()
    send.close()
    try:
        result, error = receive.recv()
    except EOFError:
        process.join()
        raise InputError(f"{problem}: it is damaged such that its reader fails") from None
    finally:
        receive.close()
    process.join()
    if error is not None:
        raise error
    return result


def _answer(call: Callable[[], Any], pipe: Any) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        answer = call(), None
    except Exception as error:
        answer = None, error
    try:
        pipe.send(answer)
    except Exception as error:  # what was read, or the error, cannot be sent
        pipe.send((None, ValueError(str(error))))

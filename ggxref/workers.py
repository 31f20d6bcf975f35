"""Work in several processes."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any


@contextmanager
def workers(jobs: int) -> Iterator[Callable[..., Any]]:
    """`submit(f, *arguments)`, whose result is called for the value: in `jobs` processes, or at once in this one.

    An exception, also an interrupt, ends what is still running.
    """
    if jobs == 1:
        yield lambda f, *arguments: lambda: f(*arguments)
        return
    # Interrupts are this process's to handle; `spawn` because a fork of a process with threads may hang.
    before = multiprocessing.active_children()
    pool = ProcessPoolExecutor(
        jobs, multiprocessing.get_context("spawn"), signal.signal, (signal.SIGINT, signal.SIG_IGN)
    )
    try:
        yield lambda f, *arguments: pool.submit(f, *arguments).result
    except BaseException:
        for process in multiprocessing.active_children():
            if process not in before:
                process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)

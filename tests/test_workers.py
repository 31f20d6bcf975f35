"""Properties: work goes to other processes and its values come back; an interrupt ends what still runs."""

import multiprocessing
import os
import time

import pytest

from ggxref.workers import workers


@pytest.mark.parametrize("jobs", [1, 2])
def test_values_come_back_in_the_order_they_are_called(jobs):
    with workers(jobs) as submit:
        calls = [submit(divmod, k, 3) for k in range(5)]
        assert [call() for call in calls] == [divmod(k, 3) for k in range(5)]
        assert (submit(os.getpid)() == os.getpid()) == (jobs == 1)


def test_an_exception_of_a_worker_is_raised_here():
    with pytest.raises(ZeroDivisionError), workers(2) as submit:
        submit(divmod, 1, 0)()


def test_an_interrupt_does_not_wait_for_the_workers():
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt), workers(2) as submit:
        submit(divmod, 1, 1)()
        submit(time.sleep, 600)
        raise KeyboardInterrupt
    assert time.monotonic() - start < 60  # ten times what starting two processes takes on a busy machine
    assert not multiprocessing.active_children()

"""The executor seam: the number of workers changes nothing but the time."""

import os
from concurrent.futures import Executor, Future

import pytest

from mapfilter._parallel import SerialExecutor, local_executor, ordered_results, rest_of
from mapfilter.errors import InputError, MapfilterError, fail


def cube(number):
    return number**3, os.getpid()


def picky(number):
    if number == 3:
        raise fail(InputError, "task 3", "another number", number)
    return number


def test_serial_and_two_processes_give_the_same_in_order():
    results = {}
    for workers in (1, 2):
        with local_executor(workers) as executor:
            results[workers] = list(ordered_results(executor, cube, range(40), in_flight=4))
    values = {workers: [value for value, _ in found] for workers, found in results.items()}
    assert values[1] == values[2] == [n**3 for n in range(40)]
    assert {pid for _, pid in results[1]} == {os.getpid()}
    assert os.getpid() not in {pid for _, pid in results[2]}


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_comes_out_at_its_place_with_its_faults(workers):
    with local_executor(workers) as executor:
        found = ordered_results(executor, picky, range(10))
        assert [next(found) for _ in range(3)] == [0, 1, 2]
        with pytest.raises(InputError) as caught:
            next(found)
    assert caught.value.faults[0].where == "task 3"


def dies(number):
    if number == 3:
        os._exit(9)
    return number


@pytest.mark.parametrize("tasks", [4, 40])
def test_a_worker_that_dies_is_told(tasks):
    with (
        pytest.raises(MapfilterError, match=r"worker processes.*ended with exit code 9 .*memory"),
        local_executor(2) as executor,
    ):
        list(ordered_results(executor, dies, range(tasks), in_flight=4))


class Counting(Executor):
    """Finishes tasks at once and counts those handed in."""

    def __init__(self):
        self.submitted = 0

    def submit(self, fn, /, *args, **kwargs):
        self.submitted += 1
        return SerialExecutor().submit(fn, *args, **kwargs)


@pytest.mark.parametrize("in_flight", [1, 3, 8, 100])
def test_no_more_than_in_flight_wait(in_flight):
    executor = Counting()
    for taken, _ in enumerate(ordered_results(executor, picky, [0] * 20, in_flight=in_flight)):
        assert executor.submitted == min(taken + in_flight, 20)
    assert executor.submitted == 20


def test_in_one_process_each_result_comes_before_the_next_task_is_begun():
    begun = []
    for result in ordered_results(SerialExecutor(), begun.append, range(5), in_flight=8):
        assert result is None
        begun.append("taken")
    assert begun == [0, "taken", 1, "taken", 2, "taken", 3, "taken", 4, "taken"]


def test_results_keep_their_order_whichever_finishes_first():
    class Backwards:
        """Resolves futures only when somebody waits, the last handed in first."""

        def __init__(self):
            self.open = []

        def submit(self, fn, task):
            executor = self

            class Lazy(Future):
                def result(self, timeout=None):
                    while executor.open:
                        future, call = executor.open.pop()
                        future.set_result(call())
                    return super().result(timeout)

            future = Lazy()
            self.open.append((future, lambda: fn(task)))
            return future

    assert list(ordered_results(Backwards(), lambda n: -n, range(7), in_flight=3)) == [
        -n for n in range(7)
    ]


def test_progress_is_told_once_for_each_task():
    told = []
    found = ordered_results(
        SerialExecutor(), picky, iter([0, 1, 2]), progress=lambda *news: told.append(news)
    )
    assert told == [], "nothing is done before somebody asks"
    assert next(found) == 0
    assert told == [(1, 3)]
    assert list(found) == [1, 2]
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_no_task_gives_no_result_and_no_progress():
    assert list(ordered_results(SerialExecutor(), picky, [], progress=pytest.fail)) == []


def test_a_serial_future_holds_the_error_until_asked_and_lets_an_interrupt_through():
    future = SerialExecutor().submit(picky, 3)
    assert isinstance(future.exception(), InputError)

    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        SerialExecutor().submit(interrupted)


def test_what_was_done_before_is_counted():
    counted = []
    report = rest_of(lambda *at: counted.append(at), 3, 5)
    report(1, 2)
    report(2)
    assert counted == [(3, 5), (4, 5), (5, 5)]
    rest_of(None, 3, 5)(1, 2)

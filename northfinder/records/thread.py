"""A thread that works jobs off in order and has a chore of its own."""

import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from queue import Empty, SimpleQueue
from threading import Thread
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

_Job = Callable[[], None]


class ChoreThread(Executor):
    """Runs jobs one after another in one thread, and a chore every so often between them.

    Args:
        name: The thread's.
        chore: What is done; what it raises ends the thread, so that it should not.
        every_s: Wall time from one chore to the next; a long job delays it.
    """

    def __init__(self, name: str, chore: Callable[[], None], every_s: float) -> None:
        self._chore = chore
        self._every_s = every_s
        self._jobs: SimpleQueue[_Job | None] = SimpleQueue()
        self._closed = False
        # A daemon: an interpreter that ends shall not wait for one that nobody has shut down.
        self._thread = Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """See :meth:`concurrent.futures.Executor.submit`."""
        if self._closed:
            msg = f"the thread {self._thread.name} has been shut down and takes no more jobs"
            raise RuntimeError(msg)
        future: Future[T] = Future()

        def job() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                future.set_result(fn(*args, **kwargs))
            except BaseException as error:  # noqa: BLE001 -- whatever it is, the waiter gets it
                future.set_exception(error)

        self._jobs.put(job)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002 -- the signature is Executor's
        """Take no more jobs, and end once those submitted are done."""
        self._closed = True
        self._jobs.put(None)
        if wait:
            self._thread.join()

    def _work(self) -> None:
        due_s = time.monotonic() + self._every_s
        while True:
            try:
                job = self._jobs.get(timeout=max(0.0, due_s - time.monotonic()))
            except Empty:
                job = _nothing
            if job is None:
                return
            job()
            del job  # its future and what it raised shall not live until the next one comes
            if time.monotonic() >= due_s:
                self._chore()
                due_s = time.monotonic() + self._every_s


def _nothing() -> None:
    """Do nothing: it is the chore's time."""

"""Ctrl-C ends a call where nothing is lost by it, and never reaches the workers that the call has started."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from multiprocessing import resource_tracker
from typing import Any

_noted = False


class ProgramKilledError(RuntimeError):
    """A signal has ended the program, for example because there was not enough memory."""


@contextlib.contextmanager
def noted() -> Iterator[None]:
    """Ctrl-C only notes that it was pressed, for `raise_if_noted`; pressed again, it raises KeyboardInterrupt at once.

    The exception of Python's own handler can be raised in any function of any library, also in those that cannot pass
    it on, such as callbacks of the garbage collector: it would be printed, and the program would go on.
    """
    global _noted
    if signal.getsignal(signal.SIGINT) is _note or threading.current_thread() is not threading.main_thread():
        yield  # Ctrl-C is noted already, or is the matter of the main thread
        return
    before = signal.signal(signal.SIGINT, _note)
    _noted = False
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def raise_if_noted() -> None:
    """Raises KeyboardInterrupt if Ctrl-C was pressed."""
    if _noted:
        raise KeyboardInterrupt


@contextlib.contextmanager
def not_in_children() -> Iterator[None]:
    """Threads and processes that are started here never see Ctrl-C."""
    resource_tracker.ensure_running()  # when it starts, it would let interruptions through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _note(*_: Any) -> None:
    global _noted
    raise_if_noted()
    _noted = True

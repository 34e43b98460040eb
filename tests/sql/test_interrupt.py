from __future__ import annotations

import gc
import signal
import threading
import weakref
from collections.abc import Iterator

import duckdb
import pytest

from msgflow.sql.interrupt import Interrupts, interruptible, noted_interrupts

SLOW = "SELECT count(*) FROM range(1000000) a, range(10000000) b WHERE a.range * b.range % 7 = 3"


@pytest.fixture(autouse=True)
def default_handler() -> Iterator[None]:
    """Ctrl-C as in any program, before each test and after it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


class Thing:
    """Something that can go away."""


def test_ctrl_c_is_not_lost_where_python_loses_it() -> None:
    """An exception in the callback of a weak reference is printed and forgotten."""
    thing = Thing()
    reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
    with noted_interrupts() as interrupts:
        interrupts.check()
        del thing
        gc.collect()
        assert reference() is None
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()


def test_the_second_ctrl_c_is_raised_at_once() -> None:
    with noted_interrupts():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_what_is_final_is_not_interrupted() -> None:
    with noted_interrupts() as interrupts:
        interrupts.make_final()
        for _ in range(3):
            signal.raise_signal(signal.SIGINT)
        interrupts.check()


def test_nothing_becomes_final_after_ctrl_c() -> None:
    with noted_interrupts() as interrupts:
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            interrupts.make_final()
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()


def test_a_failure_after_an_answered_ctrl_c_is_not_taken_for_its_consequence() -> None:
    def work() -> None:
        with noted_interrupts() as interrupts:
            signal.raise_signal(signal.SIGINT)
            interrupts.answer()
            interrupts.check()
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
            raise ValueError("disk")

    with pytest.raises(ValueError, match="disk"):
        work()


def test_an_inner_block_shares_what_the_outer_notes() -> None:
    with noted_interrupts() as outer:
        with noted_interrupts() as inner:
            assert inner is outer
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            outer.check()


@pytest.mark.parametrize("handler", [signal.SIG_IGN, lambda *_: None])
def test_the_handler_of_a_program_stays(handler: signal.Handlers) -> None:
    signal.signal(signal.SIGINT, handler)
    try:
        with noted_interrupts() as interrupts:
            assert signal.getsignal(signal.SIGINT) is handler
            signal.raise_signal(signal.SIGINT)
            interrupts.check()
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def test_another_thread_installs_nothing() -> None:
    seen: list[object] = []

    def work() -> None:
        with noted_interrupts() as interrupts:
            seen.extend((interrupts, signal.getsignal(signal.SIGINT)))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert isinstance(seen[0], Interrupts)
    assert seen[1] is signal.default_int_handler


def raise_later(connection: duckdb.DuckDBPyConnection) -> int:
    """Send Ctrl-C to this process, then run what never ends by itself."""
    signal.raise_signal(signal.SIGINT)
    connection.execute(SLOW)
    return 1


def test_a_statement_is_interrupted() -> None:
    with duckdb.connect() as connection:
        with pytest.raises(KeyboardInterrupt):
            interruptible(connection, lambda: raise_later(connection))
        assert interruptible(connection, lambda: 2) == 2


def test_a_statement_is_interrupted_where_the_program_raises_itself() -> None:
    def handler(*_: object) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, handler)
    try:
        with duckdb.connect() as connection, pytest.raises(KeyboardInterrupt):
            interruptible(connection, lambda: raise_later(connection))
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def test_errors_of_the_work_come_through() -> None:
    with duckdb.connect() as connection, pytest.raises(duckdb.CatalogException):
        interruptible(connection, lambda: connection.execute("FROM nothing"))

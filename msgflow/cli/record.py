"""Record a ROS 2 system with LTTng, then print what is wrong, what is slow, and how slow."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.cli.operation import operation
from msgflow.cli.output import (
    command_text,
    print_lines,
    print_note,
    print_result,
    print_status,
)
from msgflow.errors import ExitCode, NoFlowError, TraceError
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.run.choice import require_run_name

if TYPE_CHECKING:
    from msgflow.record.recording import Status

_SECONDS_BETWEEN_LINES = 10.0


@operation
def command(
    program: list[str] | None = None,
    *,
    output: Path | None = None,
    name: str | None = None,
    duration: Annotated[float | None, typer.Option(min=0.1)] = None,
    kernel: bool = False,
    profile: str | None = None,
    dual: str | None = None,
    on: list[str] | None = None,
    network: bool = False,
    events: list[str] | None = None,
    without: Annotated[list[str] | None, typer.Option()] = None,
    python: bool = True,
    cpu_time: bool = True,
    print_python_path: bool = False,
    subbuf_size: str = "1M",
    num_subbuf: Annotated[int, typer.Option(min=2)] = 4,
    links: Path | None = None,
    clock_sync: str | None = None,
    ingest: bool = True,
    database: Path = DEFAULT_DATABASE,
) -> None:
    """Start the nodes after the recording, best as COMMAND: what starts earlier has no names.

    Ctrl-C ends the recording, then COMMAND.

    Args:
        program ([-- COMMAND...]): What to start and record, such as `-- ros2 launch …`; it ends
            with the recording.
        output (DIR): Directory to record into; by default the name, here.
        name (NAME): Name of session and run; by default recording-DATE-TIME.
        duration (SECONDS): How long to record.
        kernel: Also record the scheduler, with LTTng or perf: why a thread waits.
        profile (HZ): Also sample functions with perf: 99, or 99:dwarf.
        dual (SESSION): Also write this snapshot session: nodes that run already.
        on (HOST): Also record on this machine, by ssh, or in container:NAME; repeatable.
        network: Also record packets with LTTng's kernel modules: clocks of machines come closer.
        without (EVENT): Leave out events, such as rclcpp_executor_wait_for_work; repeatable.
        python: Trace callbacks and executors of Python nodes of COMMAND.
        cpu_time: Read the clocks of threads where perf_event_open is allowed: what computes.
        print_python_path: Only print the folder that does so, in front of PYTHONPATH.
        subbuf_size (SIZE): Size of a sub-buffer of LTTng, per CPU.
        num_subbuf: Number of sub-buffers, per CPU.
        clock_sync (messages|FILE): As msgflow ingest has it; with --on, messages.
        ingest: Read the recording into the database.
    """
    from msgflow.cli import check
    from msgflow.cli import ingest as ingest_command
    from msgflow.cli.culprits import culprit_lines
    from msgflow.cli.tracing_cost import part_of_latencies
    from msgflow.clocks.clocks_file import read_clock_sync
    from msgflow.database import Database
    from msgflow.links.links_file import read_links
    from msgflow.query.course import read_course
    from msgflow.record.perf import read_rate
    from msgflow.record.program import PYTHON_NODES
    from msgflow.record.recording import record
    from msgflow.record.remote import read_places
    from msgflow.record.session import EVENTS, Channel
    from msgflow.result.layout import screen_width
    from msgflow.run.slice import Slice

    if print_python_path:
        typer.echo(PYTHON_NODES)
        return
    name = name or time.strftime("recording-%Y%m%d-%H%M%S")
    require_run_name(name)
    places = read_places(on or [])
    clock_sync = clock_sync or ("messages" if places else "none")
    # What is wrong with the files is said now, and not when all is recorded.
    if links is not None:
        read_links(links)
    read_clock_sync(clock_sync)
    if ingest:
        _require_database(database, name)
    target = output or Path(name)
    left_out = (event.strip() for text in without or () for event in text.split(","))
    full_names = tuple(event if ":" in event else f"ros2:{event}" for event in left_out if event)
    with _status_shown(beside_program=bool(program)) as show:
        every = (*EVENTS, *(events or []))
        recorded = record(
            target.absolute(),
            name=name,
            channel=Channel(every, subbuf_size, num_subbuf, without=full_names),
            program=program or (),
            seconds=duration,
            kernel=kernel,
            snapshot=dual,
            python=python,
            profile=None if profile is None else read_rate(profile),
            cpu_time=cpu_time,
            places=places,
            network=network,
            note=print_note,
            show=show,
        )
    print_status(f"recorded into {target}: {_words(recorded.last)}")
    if program and recorded.exit_code:
        print_note(f"{program[0]} ended with exit code {recorded.exit_code}")
    has_failed = bool(recorded.exit_code or recorded.lost)
    if not recorded.last.event_bytes:
        raise TraceError(
            f"no event of ROS 2 was recorded — {target}",
            "nodes have to run while it records, with tracing built in: ros2 run tracetools status",
        )
    if ingest:
        # What is wrong is printed by check.
        ingest_command.command(
            [str(target)],
            name=name,
            host=[f"{host}={place}" for host, place in recorded.hosts.items()],
            together=True,
            events=events or [],
            links=links,
            clock_sync=clock_sync,
            quiet=True,
            database=database,
        )
        print_status(f"read into {database} as run {name}")
        try:
            check.command(database=database)
        except typer.Exit:  # of errors in the recording, which it has printed
            has_failed = True
        with Database(database) as opened:
            try:
                found = opened.why(run=name)
            except NoFlowError:
                # There are no paths: that is said below.
                times = Slice(name)
                run = times.one_run(opened.connection, "a recording")
                course = read_course(opened.connection, run, times)
            else:
                command_of = partial(_command, database)
                whole = command_of(["why", "--wide"])
                print_lines(culprit_lines(found.verdict, command_of, screen_width(), whole=whole))
                course = found.course
            print_lines(course.picture())
            latencies = opened.query("e2e-latency", run=name)
            print_result(latencies)
            for sentence in part_of_latencies(opened, latencies):
                print_status(sentence)
    if recorded.is_cut:
        raise typer.Exit(ExitCode.TRACE)
    if has_failed:
        raise typer.Exit(ExitCode.FAILED)


def _command(database: Path, words: Sequence[str]) -> str:
    return command_text(["msgflow", *words], database)


def _require_database(database: Path, name: str) -> None:
    """Refuse a database that cannot take the recording, before it is made."""
    from msgflow.db.connection import connect
    from msgflow.db.migration import require_ingestable
    from msgflow.db.workspace import workspace
    from msgflow.ingest.stored_run import require_free_name

    require_ingestable(database)
    with workspace(database):
        pass
    if database.exists():
        with closing(connect(database, read_only=True)) as con:
            require_free_name(con, name)


@contextmanager
def _status_shown(*, beside_program: bool) -> Iterator[Callable[[Status], None]]:
    """Yield the function that shows how the recording goes, on a terminal only."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda status: None
    elif beside_program:
        # It writes to the terminal, too: a line that moves would tear.
        last = 0.0

        def print_line(status: Status) -> None:
            nonlocal last
            if status.seconds - last >= _SECONDS_BETWEEN_LINES:
                last = status.seconds
                print_status(f"recording (Ctrl-C ends it): {_words(status)}")

        yield print_line
    else:
        from rich.status import Status as Line

        with Line("starting LTTng", console=console) as line:
            yield lambda status: line.update(f"recording (Ctrl-C ends it): {_words(status)}")


def _words(status: Status) -> str:
    from msgflow.record.recording import BYTES_OF_EVENT

    events = status.event_bytes / BYTES_OF_EVENT
    words = [
        f"{status.seconds:.0f} s",
        f"some {events:,.0f} events written ({events / max(status.seconds, 1):,.0f}/s)",
        f"{status.discarded:,} discarded",
        f"{status.free_bytes / 1e9:,.0f} GB free",
    ]
    return ", ".join(words)

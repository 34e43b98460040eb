"""See a ROS 2 system while it runs: latency of every path, window by window."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from itertools import chain, count
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from msgflow.cli.operation import operation
from msgflow.cli.options import path_of
from msgflow.cli.output import is_screen, print_lines, print_note, print_status
from msgflow.database import named_places
from msgflow.errors import ExitCode, TraceError, UsageError
from msgflow.files.default_files import DEFAULT_PATHS
from msgflow.run.window import duration_ns
from msgflow.text.values import printable

if TYPE_CHECKING:
    from msgflow.record.recording import Status
    from msgflow.watch.diagnostics import Diagnostics
    from msgflow.watch.window_database import WindowDatabase
    from msgflow.watch.window_report import WindowReport

_START = "starts, records and watches a program"


class Command(TyperCommand):
    """The command, which keeps the words behind `--` apart from its own: as `args`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words before `--`."""
        own, program = args, []
        if "--" in args:
            place = args.index("--")
            own, program = args[:place], args[place + 1 :]
        super().parse_args(ctx, own)
        ctx.args = program
        return program


@operation
def command(
    context: typer.Context,
    words: list[str] | None = None,
    *,
    window: str = "10s",
    step: str = "2s",
    late: str | None = None,
    links: Path | None = None,
    clock_sync: str = "none",
    once: bool = False,
    targets: Path | None = None,
    paths: Path = Path(DEFAULT_PATHS),
    keep_on_violation: Path | None = None,
    keep_before: str | None = None,
    keep_most: Annotated[int, typer.Option(min=1)] = 20,
    prometheus: str | None = None,
    diagnostics: bool = False,
    ui: Annotated[int | None, typer.Option(min=0, max=65535)] = None,
    json: bool = False,
    output: Path | None = None,
) -> None:
    """Ctrl-C ends it. `msgflow watch -- ros2 launch …` starts, records and watches a system; Ctrl-C
    ends that, too. With --targets the exit code is that of `msgflow verify`. It is 1 if COMMAND
    failed.

    Args:
        words (SESSION|DIR|-- COMMAND...): An LTTng session, a directory into which rotated
            recordings come, or what to start, record and watch. By default the only session.
        window (TIME): Length of a window.
        step (TIME): How far a window is from the one before.
        late (TIME): How long a window waits for chunks and messages that are late; by default
            two steps.
        once: Read a finished recording from its first to its last chunk.
        targets: Requirements, as YAML: what is violated is said at once.
        keep_on_violation (DIR): Keep the chunks around a violation there, with a database of them.
        keep_before (TIME): Also keep what came so long before the window of a violation, such as
            5min.
        keep_most: Most violations that are kept, the last ones.
        prometheus (PORT): Serve metrics for Prometheus on 127.0.0.1; ADDRESS:PORT serves others.
        diagnostics: Publish the verdicts on --targets on /diagnostics, by rclpy.
        ui (PORT): Show the window in the browser, like `msgflow ui`, at this port of 127.0.0.1; 0
            takes any that is free.
        json: Print one JSON object per window.
        output (DIR): Directory to record COMMAND into; by default a temporary one, of the last
            chunks.
    """
    from msgflow.cli.show.watch_screen import show_screen, window_line
    from msgflow.clocks.clocks_file import read_clock_sync
    from msgflow.links.links_file import read_links
    from msgflow.sql.interrupt import until_interrupted
    from msgflow.verify.targets_file import read_targets
    from msgflow.verify.verify import Verdict
    from msgflow.watch.alarm import Alarm, violation_line
    from msgflow.watch.diagnostics import Diagnostics
    from msgflow.watch.flight_recorder import FlightRecorder
    from msgflow.watch.follow import watch_finished, watch_live
    from msgflow.watch.prometheus import Exporter
    from msgflow.watch.silences import silence_line
    from msgflow.watch.watched_sessions import WatchedSessions, watched_place
    from msgflow.watch.watcher import Watcher

    program = context.args
    word = _only_word(words or [], program, once=once, directory=output)
    earlier_ns = 0 if keep_before is None else duration_ns(keep_before, "--keep-before")
    step_ns = duration_ns(step, "--step")
    window_ns = duration_ns(window, "--window")
    late_ns = 2 * step_ns if late is None else duration_ns(late, "--late", least_ns=0)
    if keep_before is not None and keep_on_violation is None:
        raise UsageError(
            "--keep-before is about violations that are kept",
            f"--keep-on-violation DIR --keep-before {keep_before}",
        )
    if diagnostics and targets is None:
        raise UsageError("--diagnostics tells the verdicts on targets", "--targets targets.yaml")
    alarm = None
    if targets is not None:
        file = read_targets(targets)
        alarm = Alarm(file, named_places(file, paths), print_note, with_flows=diagnostics)
    # Where stdout is closed, nothing starts.
    on_screen = is_screen() and not json
    exporter = None
    if prometheus is not None:
        exporter = Exporter()
        exporter.serve(prometheus)
    has_failed = False
    with _pages(ui, clock_sync) as database, ExitStack() as stack:
        recorder = None
        if keep_on_violation is not None:
            recorder = FlightRecorder(
                keep_on_violation.absolute(),
                most=keep_most,
                window_ns=window_ns,
                earlier_ns=earlier_ns,
                clock_sync=clock_sync,
                note=print_note,
            )
            stack.callback(recorder.close)
        watcher = Watcher(
            window_ns=window_ns,
            step_ns=step_ns,
            late_ns=late_ns,
            links=None if links is None else read_links(links),
            clocks=read_clock_sync(clock_sync),
            note=print_note,
            alarm=alarm,
            recorder=recorder,
            exporter=exporter,
            database=database,
            has_node=diagnostics,
        )
        stack.callback(watcher.close)
        publisher = stack.enter_context(closing(Diagnostics())) if diagnostics else None

        def show(reports: Iterator[WindowReport]) -> None:
            if publisher is not None:
                reports = _published(reports, publisher)
            if on_screen:
                show_screen(reports)
                return
            for report in reports:
                if json:
                    print_lines([report.to_json()])
                    continue
                violated = (f"violation: {violation_line(each)}" for each in report.violations)
                stopped = map(silence_line, report.stopped)
                print_lines([window_line(report), *map(printable, [*violated, *stopped])])

        def live(place: Path, is_over: Callable[[], bool]) -> None:
            show(watch_live(place, watcher, step_ns=step_ns, is_over=is_over, note=print_note))

        if program:
            if output is None:
                # The recording is ours alone: it need not grow.
                watcher.on_passed = partial(shutil.rmtree, ignore_errors=True)
            has_failed = _record(program, output, step_ns, live, on_screen=on_screen)
        elif once:
            finished = path_of(str(word)).absolute()
            if not finished.is_dir():
                raise TraceError(
                    f"no such directory — {word}",
                    "--once reads the directory of a rotated recording",
                )
            show(watch_finished(finished, watcher))
        else:
            place = watched_place(word)
            with (
                WatchedSessions(place, step_ns, print_note) as sessions,
                until_interrupted() as interrupts,
            ):

                def is_over() -> bool:
                    interrupts.check()
                    return sessions.are_over()

                live(place, is_over)
    if has_failed or (alarm is not None and alarm.count(Verdict.FAILED)):
        raise typer.Exit(ExitCode.FAILED)
    # Without a window, nothing was measured.
    if alarm is not None and not alarm.is_measured:
        raise typer.Exit(ExitCode.NOT_MEASURED)


def _only_word(
    words: list[str], program: list[str], *, once: bool, directory: Path | None
) -> str | None:
    if program:
        alone = f"msgflow watch -- {shlex.join(program)} {_START}"
        if words:
            raise UsageError(f"a program is watched alone — {shlex.join(words)}", alone)
        if once:
            raise UsageError("--once reads a finished recording, not a program", alone)
        return None
    if directory is not None:
        raise UsageError(
            "-o names the directory of a program that is recorded: COMMAND is missing",
            f"msgflow watch -o {shlex.quote(str(directory))} -- COMMAND",
        )
    if len(words) > 1:
        raise UsageError(
            f"one session or directory is watched, not {len(words)} — {shlex.join(words)}",
            "name a directory above them"
            if once
            else f"name a directory above them; msgflow watch -- {shlex.join(words)} {_START}",
        )
    if once and not words:
        raise UsageError("--once needs a directory", "msgflow watch --once DIR")
    return words[0] if words else None


@contextmanager
def _pages(port: int | None, clock_sync: str) -> Iterator[WindowDatabase | None]:
    """Serve pages of the last window during the block, unless there is no port for them."""
    if port is None:
        yield None
        return
    from msgflow.cli.sql_process import WarmSql
    from msgflow.files.temporary_owner import temporary_directory
    from msgflow.record.session import TEMPORARY
    from msgflow.view.server import serving
    from msgflow.view.sql_page import MOST_SECONDS
    from msgflow.watch.window_database import WindowDatabase

    with temporary_directory(TEMPORARY) as directory:
        path = directory / "window.duckdb"
        database = WindowDatabase(path, clock_sync=clock_sync)
        with (
            closing(WarmSql(path, memory_limit=None, seconds=MOST_SECONDS)) as sql,
            serving(path, sql, port=port, following=database, place="msgflow watch") as (
                address,
                _,
            ),
        ):
            print_status(address)
            yield database


def _published(reports: Iterator[WindowReport], publisher: Diagnostics) -> Iterator[WindowReport]:
    for report in reports:
        publisher.show(report)
        yield report


def _free(name: str) -> Path:
    """Return a path where nothing is, also no link that leads nowhere."""
    path = Path(name)
    numbered = (path.with_stem(f"{path.stem}-{number}") for number in count(2))
    return next(one for one in chain([path], numbered) if not os.path.lexists(one))


def _record(
    words: list[str],
    directory: Path | None,
    step_ns: int,
    live: Callable[[Path, Callable[[], bool]], None],
    *,
    on_screen: bool,
) -> bool:
    """Start a program, record it, and watch the recording until it ends; tell whether it failed."""
    from msgflow.files.temporary_owner import temporary_directory
    from msgflow.record.recording import record
    from msgflow.record.session import TEMPORARY, Channel

    name = f"watch-{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}"
    # A file, since the program would stop if it wrote to a full pipe.
    log = _free(f"{directory or name}.log") if on_screen and sys.stderr.isatty() else None
    ended = Event()
    with temporary_directory(TEMPORARY) as temporary, ThreadPoolExecutor(1) as beside:
        target = (directory or temporary / "recording").absolute()
        # The main thread records: it has the signals.
        watching = beside.submit(live, target, ended.is_set)

        def show(status: Status) -> None:
            if watching.done():
                # It has failed: it ends with the recording only.
                watching.result()

        try:
            recorded = record(
                target,
                name=name,
                channel=Channel(rotation_ns=step_ns),
                program=words,
                log=log,
                note=print_note,
                show=show,
            )
        finally:
            ended.set()
        watching.result()
    if recorded.exit_code:
        where = "" if log is None or not log.exists() else f": {log} has what it printed"
        print_note(f"{words[0]} ended with exit code {recorded.exit_code}{where}")
    return bool(recorded.exit_code)

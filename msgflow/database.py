"""Database of msgflow as a Python object."""

from __future__ import annotations

import os
import re
import shlex
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar, overload

from msgflow.backports import Unpack
from msgflow.errors import QueryError, UsageError
from msgflow.files.default_files import DEFAULT_PATHS
from msgflow.query.catalogue import choose_query, load_queries, queries_meant
from msgflow.query.names import names_in, numbered_path, with_path_numbers
from msgflow.query.selection import PATH, columns_of, make_selection
from msgflow.run.choice import Run, read_runs
from msgflow.run.slice import Slice, SliceWords, TimeWords
from msgflow.sql.interrupt import interruptible
from msgflow.text.name_suggestions import did_you_mean

# What is imported here, `msgflow COMMAND --help` waits for: DuckDB and what asks it are not.
if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.db.finding import Finding
    from msgflow.export.flow import Flow
    from msgflow.export.folded import FoldedStacks
    from msgflow.export.graph import Graph
    from msgflow.export.mcap import ExportedMcap
    from msgflow.export.otlp import ExportedTraces
    from msgflow.export.perfetto import PerfettoTrace
    from msgflow.export.timing_model import TimingModel
    from msgflow.export.view_files import ExportedView
    from msgflow.ingest import IngestProgress, IngestReport
    from msgflow.links.annotations import AppliedLinks
    from msgflow.links.suggested_links import LinkSuggestions
    from msgflow.paths.paths_file import NamedPath, PathsFile
    from msgflow.query.compare import Comparison
    from msgflow.query.flow import Start
    from msgflow.query.moment import Moment
    from msgflow.query.story import Story
    from msgflow.query.why import Explanation
    from msgflow.replay.remedies import Remedies
    from msgflow.result.query_result import QueryResult
    from msgflow.sql.header import Header
    from msgflow.sql.value import Value
    from msgflow.verify.targets_file import TargetsFile
    from msgflow.verify.verify import Verification
    from msgflow.view.report import Report

_T = TypeVar("_T")
_P = ParamSpec("_P")

DEFAULT_LIMIT = 10_000
_WRITING_WITH = re.compile(r"WITH clause containing a .* statement must be at the top level")
_MISSING_TABLE = re.compile(r"Table with name (\S+) does not exist")
# Bytes of a report: mail servers take that much.
DEFAULT_REPORT_SIZE = 20_000_000

_SCHEMA = """
SELECT columns.table_name AS view, columns.column_name AS column, columns.data_type AS type,
    columns.comment AS description
FROM duckdb_columns() AS columns
JOIN duckdb_views() AS views
    ON views.database_name = columns.database_name
    AND views.schema_name = columns.schema_name
    AND views.view_name = columns.table_name
WHERE columns.database_name = current_database() AND columns.schema_name = 'main'
    AND NOT views.internal
    AND columns.table_name = coalesce($view, columns.table_name)
ORDER BY columns.table_name, columns.column_index
"""
_VIEWS = """
SELECT view_name AS view, column_count AS columns, split_part(comment, '. ', 1) AS description
FROM duckdb_views()
WHERE database_name = current_database() AND schema_name = 'main' AND NOT internal
ORDER BY view_name
"""


class Database:
    """A database file: ingest into it, ask it, export it.

    All reading uses one read-only connection without access to other files or the network; the
    first question opens it. Use the object as a context manager, or call `close`. Many methods take
    `run`, `start` and `end`: `msgflow.Slice` explains them. Methods raise a DatabaseError if the
    file is missing, locked, foreign or of another schema revision, and a QueryError if DuckDB
    cannot answer.

    Attributes:
        path: the file; `ingest` creates it.
    """

    def __init__(self, path: str | Path, *, memory_limit: str | None = None) -> None:
        self.path = Path(path)
        self._memory_limit = memory_limit or os.environ.get("MSGFLOW_MEMORY_LIMIT")
        self._connection: duckdb.DuckDBPyConnection | None = None

    def __enter__(self) -> Database:
        return self

    def __exit__(self, kind: object, error: BaseException | None, *_: object) -> None:
        try:
            if error is not None and self._connection is not None:
                import duckdb

                from msgflow.db.connection import require_ours

                # Views that somebody changed may lack what a question reads.
                if isinstance(error, duckdb.Error):
                    require_ours(self._connection, self.path)
        finally:
            self.close()

    def close(self) -> None:
        """Close the file; a later question opens it again."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    @property
    def connection(self) -> duckdb.DuckDBPyConnection:
        """The read-only connection, opened at first use.

        Raises:
            DatabaseError: the file is missing, locked, foreign, or of another schema revision.
        """
        from msgflow.db.connection import connect

        if self._connection is None:
            self._connection = connect(self.path, read_only=True, memory_limit=self._memory_limit)
        return self._connection

    def _ask(
        self,
        work: Callable[Concatenate[duckdb.DuckDBPyConnection, _P], _T],
        *given: _P.args,
        **named: _P.kwargs,
    ) -> _T:
        """Return what `work` returns for the connection; Ctrl-C interrupts it."""
        import duckdb

        from msgflow.sql.failure import database_errors, out_of_memory, out_of_range

        connection = self.connection
        try:
            with database_errors(self.path):
                return interruptible(
                    connection, lambda: work(connection, *given, **named), only_reads=True
                )
        except duckdb.OutOfMemoryException as error:
            raise out_of_memory(str(self.path)) from error
        except duckdb.OutOfRangeException as error:
            raise out_of_range(error, self.path) from error

    def _change(
        self,
        work: Callable[Concatenate[duckdb.DuckDBPyConnection, tuple[Run, ...], _P], _T],
        run: str | int | None,
        *given: _P.args,
        **named: _P.kwargs,
    ) -> _T:
        """Return what `work` returns for a writing connection and the runs, in one transaction."""
        from msgflow.db.runs import change_runs

        self.close()
        return change_runs(
            self.path,
            run,
            lambda connection, runs: work(connection, runs, *given, **named),
            memory_limit=self._memory_limit,
        )

    def record(
        self,
        program: Sequence[str] = (),
        *,
        directory: str | Path,
        seconds: float | None = None,
        kernel: bool = False,
        profile: str | None = None,
        cpu_time: bool = True,
        on: Sequence[str] = (),
        note: Callable[[str], None] = warnings.warn,
    ) -> IngestReport:
        """Record a ROS 2 system with LTTng, and ingest it as the run with the directory's name.

        It records until the program ends, so many seconds, or until Ctrl-C. Nodes that run before
        have no names; `msgflow.testing` records a block of a test.

        Args:
            program: to start when all is ready, and to end afterwards; with its arguments.
            directory: to write to; it must not exist, or be empty.
            seconds: how long to record.
            kernel: also record what the scheduler does.
            profile: also sample functions: '99' times a second, or '99:dwarf'.
            cpu_time: also read the clocks of threads, where perf_event_open is allowed.
            on: machines of ssh, 'robot' or 'user@robot', and 'container:NAME', to record on, too;
                clocks are brought together by messages.
            note: gets sentences about what is wrong with the recording.

        Raises:
            RecordingError: LTTng is missing or refuses, the directory is in use, or the disk full.
            UsageError: there is no such program or rate, or not the name of a machine.
            TraceError: nothing of ROS 2 was recorded.
        """
        from msgflow.record.perf import read_rate
        from msgflow.record.recording import record
        from msgflow.record.remote import read_places
        from msgflow.record.session import Channel

        places = read_places(on)
        place = Path(directory).absolute()
        recorded = record(
            place,
            name=place.name,
            channel=Channel(),
            program=program,
            seconds=seconds,
            kernel=kernel,
            profile=None if profile is None else read_rate(profile),
            cpu_time=cpu_time,
            places=places,
            note=note,
            show=lambda status: None,
        )
        if recorded.exit_code:
            note(f"{program[0]} ended with exit code {recorded.exit_code}")
        return self.ingest(
            place,
            hosts=recorded.hosts,
            clock_sync="messages" if places else "none",
        )

    def ingest(
        self,
        paths: str | Path | Sequence[str | Path],
        *,
        name: str | None = None,
        replace: bool = False,
        hosts: Mapping[str, str | Path | Sequence[str | Path]] | None = None,
        keep_staging: str | Path | None = None,
        links: str | Path | None = None,
        clock_sync: str | Path = "none",
        reader: str = "auto",
        strict: bool = False,
        ignore: Sequence[str] = (),
        events: Sequence[str] = (),
        progress: Callable[[IngestProgress], None] | None = None,
    ) -> IngestReport:
        """Read all traces below `paths` as one run, in one transaction.

        Args:
            paths: CTF directories, or directories above some.
            name: of the run; made from the paths when None.
            replace: take the place of a run with the same name or packets.
            hosts: path or paths by name of a host; the traces below belong to that host. If several
                paths lead to a trace, the deepest one counts.
            keep_staging: directory for the staging tables as Parquet.
            links: file with indirect links to declare.
            clock_sync: how to correct the clocks of several hosts: 'none', 'messages', or a file
                with the offset of each, see docs/clocks.md.
            reader: 'auto', 'msgflow' or 'bt2'.
            strict: refuse a trace at its first damage, instead of keeping what is good.
            ignore: names of events to leave out.
            events: names of the user's own events to load into `user_event`, such as 'my_pkg:*'.
            progress: called now and then while reading.

        Raises:
            TraceError: no trace, or none that can be read.
            UsageError: `links` is not such a file, or does not fit the traces; a path in `hosts`
                with two names, or without a trace of its own.
        """
        from msgflow.ingest import ingest

        self.close()
        return ingest(
            [paths] if isinstance(paths, str | Path) else list(paths),
            self.path,
            name=name,
            replace=replace,
            hosts=dict(hosts) if hosts else None,
            keep_staging=Path(keep_staging) if keep_staging is not None else None,
            links=Path(links) if links is not None else None,
            clock_sync=clock_sync,
            reader=reader,
            strict=strict,
            ignore=ignore,
            events=events,
            memory_limit=self._memory_limit,
            progress=progress,
        )

    def apply_links(
        self, file: str | Path, *, run: str | int | None = None, content: str | None = None
    ) -> tuple[AppliedLinks, ...]:
        """Declare the links and topics of a file and derive all links anew, in one transaction.

        What an earlier file declared for these runs is removed.

        Args:
            file: YAML; docs/links.md has its form.
            run: 'all', a name or an id; the latest run when None.
            content: of the file, if it is not written yet.

        Raises:
            UsageError: not such a file, no such run, or a link that does not fit the run.
        """
        from msgflow.links.annotations import apply_links
        from msgflow.links.links_file import read_links

        return self._change(apply_links, run, read_links(Path(file), content))

    def suggest_links(self, *, run: str | int | None = None) -> LinkSuggestions:
        """Return candidates for links of a run, its unnamed topics, and what a file declared.

        Args:
            run: a name or an id; the latest run when None.

        Raises:
            UsageError: no such run.
        """
        from msgflow.links.suggested_links import LinkSuggestions
        from msgflow.sql.statement import internal_sql

        found = self.query("links-suggested", run=run)

        def of_file(name: str) -> list[dict[str, Any]]:
            asked = partial(internal_sql().rows, self.connection, name)
            return [row for one in found.runs for row in asked({"run_id": one.run_id})]

        rows = found.to_arrow().to_pylist()
        return LinkSuggestions(found.runs, rows, of_file("link_of_file"), of_file("topic_of_file"))

    def apply_clocks(
        self, clock_sync: str | Path, *, run: str | int | None = None
    ) -> tuple[Run, ...]:
        """Correct the clocks of several hosts, or leave them as recorded.

        Args:
            clock_sync: 'none', 'messages', or a file with the offset of each clock.
            run: 'all', a name or an id; the latest run when None.

        Returns:
            The runs with corrected clocks.

        Raises:
            UsageError: no such file or run, or a file that does not fit the run.
        """
        from msgflow.clocks.clocks_file import read_clock_sync
        from msgflow.clocks.correction import apply_clocks

        return self._change(apply_clocks, run, read_clock_sync(clock_sync))

    def join_bag(self, bag: str | Path, *, run: str | int | None = None) -> QueryResult:
        """Join the messages of a bag to their publications: size, header.stamp, frame_id.

        The bag was recorded in the same run. It replaces an earlier one. What cannot be joined is
        counted, by topic. The view `bag_message` has the messages.

        Args:
            bag (BAG): directory of a rosbag2, or one of its files (.mcap, .db3).
            run: a name or an id; by default the latest run.

        Returns:
            A row per topic of the bag: how many messages were joined, and why others were not.

        Raises:
            UsageError: no such run or several, clocks that are not synchronised, or the package
                rosbags is not installed.
            TraceError: not a bag, a damaged one, or one that takes too much memory.
        """
        from msgflow.bag.messages import join_bag, read_bag

        # The database is opened for a bag that can be read.
        with read_bag(Path(bag), memory_limit=self._memory_limit) as messages:
            return self._change(join_bag, run, messages)

    def rename_run(self, run: str | int, name: str) -> Run:
        """Give a run another name, and return it as it was.

        Args:
            run: a name or an id.
            name: the new name, which no other run has.

        Raises:
            UsageError: no such run, or a name that another run has or that `run` reads otherwise.
        """
        from msgflow.db.runs import rename_run

        return self._change(rename_run, run, run, name)

    def label_runs(self, run: str | int, **labels: str | None) -> tuple[Run, ...]:
        """Give runs labels, and return the runs as they were.

        Args:
            run: 'all', a name, an id, or a label that runs have (KEY=VALUE).
            **labels: values by key; None removes the label.

        Raises:
            UsageError: no such run, an invalid key or value, or no such label to remove.
        """
        from msgflow.db.runs import label_runs

        return self._change(label_runs, run, labels)

    def remove_runs(self, run: str | int) -> tuple[Run, ...]:
        """Delete runs with all their data, and return them.

        Args:
            run: 'all', a name or an id.

        Raises:
            UsageError: no such run.
        """
        from msgflow.db.runs import remove_runs

        return self._change(remove_runs, run)

    def query(
        self,
        name: str,
        /,
        *,
        run: str | int | None = None,
        start: str | int | None = None,
        end: str | int | None = None,
        internal: bool = False,
        node: str | Sequence[str] | None = None,
        topic: str | Sequence[str] | None = None,
        callback: str | Sequence[str] | None = None,
        host: str | Sequence[str] | None = None,
        via: str | Sequence[str] | None = None,
        without: str | Sequence[str] | None = None,
        where: str | None = None,
        sort: str | Sequence[str] | None = None,
        limit: int | None = None,
        slowest: int | None = None,
        path: str | None = None,
        paths: str | Path = DEFAULT_PATHS,
        **parameters: Value,
    ) -> QueryResult:
        """Run a named query.

        Rows can be chosen by the kinds of names in the columns of the query. Names may be globs.
        Names in a list are taken as they are. A text is the name that a run has, else several names
        between commas.

        Args:
            name: of the query, see `list_queries`.
            run, start, end: what to read, see `msgflow.Slice`.
            internal: show the rows of ROS's own topics and services too.
            node: rows that name one of these nodes.
            topic: rows that name one of these topics.
            callback: rows that name one of these callbacks, such as 'Timer(*)'.
            host: rows that name one of these hosts.
            via: paths that visit all of these nodes, topics and services.
            without: paths that visit none of these.
            where: a condition in SQL on the columns of the query, such as 'p99_ns > 80e6'.
            sort: column to sort by, 'p99_ns' or 'p99_ns:desc', or several.
            limit: most rows.
            slowest: number of the slowest rows, for queries whose rows have a duration.
            path: number of a path, or its name in a file; in place of from, to, via and without.
            paths: the file with the paths that have names.
            parameters: the query's own; `from_` means `from`.

        Raises:
            UsageError: a query, parameter, name, column, run or time that does not exist or cannot
                be read, a condition that does more than read, or rows that the query does not have.
        """
        from msgflow.db.objects import public_names
        from msgflow.db.sql_guard import require_condition
        from msgflow.query.runner import run_query

        header = choose_query(name, parameters, public_names)
        part = Slice(run, start, end)
        own = {param.name for param in header.params}
        if path is not None:
            if via or without or {"from", "from_", "to", "to_"} & set(parameters):
                raise _path_and_others(path)
            takes = own | ({"via", "without"} if columns_of(header, PATH) else set())
            words = self._ask(_words_of_path, path, Path(paths), part) if "from" in takes else {}
            if not words or not words.keys() <= takes:
                raise UsageError(f"{header.words} has no paths — --path {path}", "leave it out")
            via, without = words.pop("via", None), words.pop("without", None)
            parameters |= {word: [*names] for word, names in words.items()}
        selection = {
            "node": node, "topic": topic, "callback": callback, "host": host, "via": via,
            "without": without, "where": where, "sort": sort, "limit": limit, "slowest": slowest,
        }  # fmt: skip
        # A query applies its own parameters itself.
        for word in own & {word for word, value in selection.items() if value is not None}:
            parameters[word] = selection.pop(word)  # type: ignore[assignment]

        def ask(connection: duckdb.DuckDBPyConnection) -> QueryResult:
            if where is not None:
                require_condition(connection, where)
            runs = part.runs(connection)
            chosen = make_selection(selection, partial(names_in, connection, runs))
            result = run_query(
                connection, header, parameters, part, internal=internal, selection=chosen
            )
            return with_path_numbers(connection, result)

        return self._ask(ask)

    @overload
    def why(
        self, place: str | None = None, *, at: None = None, **part: Unpack[SliceWords]
    ) -> Explanation: ...

    @overload
    def why(
        self, place: str | None = None, *, at: str | int, **part: Unpack[SliceWords]
    ) -> Moment: ...

    def why(
        self, place: str | None = None, *, at: str | int | None = None, **part: Unpack[SliceWords]
    ) -> Explanation | Moment:
        """Explain why a topic is late: who is to blame, where the time goes, what to ask next.

        The first path is that of the worst culprit, or the slowest: all other sections are about
        it. Each section but the verdict and the doubts, which are findings, is part of a named
        query, with the same numbers: e2e-latency, path-breakdown, critical-path, waits --by pair,
        and topics --measure delivery. With `at` it explains a moment: what changed around it, what
        began and ran then, which paths were slow.

        Args:
            place: topic or node where the flows end; a glob is possible. By default all ends.
            at: a moment to explain: an offset from the run's start such as '8s', epoch ns, or ISO
                time.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: not exactly one run, or no such place or time.
            NoFlowError: no flow arrives there.
        """
        from msgflow.query.moment import explain_moment
        from msgflow.query.why import explain
        from msgflow.replay.remedies import suggested

        one = self._ask(Slice(part.get("run")).one_run, "an explanation")
        times = Slice(one.run_id, part.get("start"), part.get("end"))
        if at is not None:
            return self._ask(explain_moment, one, times, at, place)
        found = self._ask(explain, one, times, place)
        return replace(found, suggestion=self._ask(suggested, found))

    def remedies(
        self,
        place: str | None = None,
        *,
        progress: Callable[[int, int, str], None] = lambda *_: None,
        **part: Unpack[SliceWords],
    ) -> Remedies:
        """Try what may make a topic's data sooner, in replays of the run: the best first.

        Args:
            place: topic or node where the flows end; a glob is possible. By default all ends.
            progress: gets the number of a replay, how many there are, and what is tried.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: not exactly one run, or no such place or time.
            NoFlowError: no flow arrives there.
        """
        from msgflow.query.why import explain
        from msgflow.replay.predict import Predictor
        from msgflow.replay.remedies import find_remedies

        one = self._ask(Slice(part.get("run")).one_run, "an explanation")
        times = Slice(one.run_id, part.get("start"), part.get("end"))
        found = self._ask(explain, one, times, place)
        predictor = self._ask(Predictor, one)
        # Not by `_ask`: it is no statement of DuckDB that Ctrl-C has to end.
        return find_remedies(self.connection, predictor, found, progress)

    def predict(
        self,
        place: str | None = None,
        *,
        changes: Sequence[str] = (),
        run: str | int | None = None,
        keep: str | Path | None = None,
    ) -> QueryResult:
        """Replay a run with changes, and return what they do to each path; docs/replay.md has them.

        Without changes it shows how near a replay is to the recording.

        Args:
            place: only paths that end at this topic or node; a glob is possible.
            changes: such as 'threads(/perception)=2' or 'duration(/detector on_image)*0.7'.
            run: a name or an id; the latest run when None.
            keep: new database with the run and the same as it was replayed, to compare them.

        Raises:
            UsageError: no such run, a change that cannot be read or that changes nothing, or a file
                that exists.
        """
        if keep is not None and Path(keep).exists():
            raise UsageError(f"the file exists — {keep}", "another one: --keep FILE")
        from msgflow.replay.change import changed, read_change, require_effect
        from msgflow.replay.engine import Replay
        from msgflow.replay.predict import Predictor
        from msgflow.replay.predicted_run import write_predicted
        from msgflow.replay.remedies import predicted_paths

        wanted = [read_change(text) for text in changes]
        one = self._ask(Slice(run).one_run, "a replay")
        predictor = self._ask(Predictor, one)
        for change in wanted:
            require_effect(predictor.system, change)
        found = predicted_paths(self.connection, one, predictor, wanted, place)
        if keep is None:
            return found
        system = changed(predictor.system, wanted)
        replay = Replay(system)
        replay.latencies()
        name = self._ask(write_predicted, one, system, replay, wanted, Path(keep))
        step = shlex.join(["msgflow", "compare", one.name, name, "--db", str(keep)])
        return replace(found, notes=[*found.notes, f"kept as {name}: {step}"])

    def story(
        self,
        goal: str | int | None = None,
        *,
        request_id: int | None = None,
        run: str | int | None = None,
    ) -> Story:
        """Tell what became of a goal, or of a call of a service: what took longest, and why.

        Args:
            goal: `goal_id` of the view `goal`, or its first digits.
            request_id: in place of that, id of a request to a service.
            run: run of the goal; any when None.

        Raises:
            UsageError: not exactly one of them, or one that does not exist.
        """
        from msgflow.query.story import goal_meant, read_story

        if goal is not None and request_id is None:
            request_id = self._ask(goal_meant, goal, run)
        elif goal is not None or request_id is None:
            raise UsageError("a story is of one goal or one request", "msgflow why --goal ID")
        return self._ask(read_story, request_id)

    def flow(
        self,
        place: str | None = None,
        *,
        at: str | int | None = None,
        publication_id: int | None = None,
        take_id: int | None = None,
        callback_instance_id: int | None = None,
        request_id: int | None = None,
        response_id: int | None = None,
        goal: str | int | None = None,
        run: str | int | None = None,
        direction: str = "both",
        depth: int = 32,
        limit: int = 1_000,
        internal: bool = False,
    ) -> Flow:
        """Return the causes and effects of one message; `print` draws them as a tree.

        Args:
            place: start at the first message on this topic, or at what this node did first, at or
                after `at`; else give an id.
            at: epoch ns, an offset from the run's start such as '2.5s', or ISO time; by default the
                begin of the run.
            publication_id: id of a publication.
            take_id: id of a take.
            callback_instance_id: id of a callback instance.
            request_id: id of a request to a service.
            response_id: id of a response of a service.
            goal: id of a goal of an action, or its first digits.
            run: a name or an id; by default the latest one, or that of the id.
            direction: 'forward' (effects), 'backward' (causes) or 'both'.
            depth: most messages in a row, each way.
            limit: most publications, takes, callback instances, requests and responses.
            internal: follow messages on ROS's own topics and services, too.

        Raises:
            UsageError: not exactly one start, or one that does not exist.
        """
        from msgflow.export.flow import read_flow
        from msgflow.query.story import goal_meant

        if goal is not None:
            if request_id is not None:
                raise UsageError("a flow starts from one thing: a goal or a request", "give one")
            request_id, run = self._ask(goal_meant, goal, run), None
        given = (publication_id, take_id, callback_instance_id, request_id, response_id)
        start = self._ask(_start, place, given, at, run)
        return self._ask(
            read_flow, start, direction=direction, depth=depth, limit=limit, internal=internal
        )

    def flow_why(
        self,
        place: str | None = None,
        *,
        at: str | int | None = None,
        publication_id: int | None = None,
        take_id: int | None = None,
        callback_instance_id: int | None = None,
        run: str | int | None = None,
        from_: Value = None,
        case: str = "every_pair",
        by: str = "piece",
        detail: str = "short",
        internal: bool = False,
    ) -> QueryResult:
        """Return what a message waited for: the query critical-path for the flow up to its take.

        Of a publication with several takes, the one with the longest latency counts.

        Args:
            place, at, publication_id, take_id, callback_instance_id, run: the message, as `flow`
                takes them.
            from_: topic or node where the flow starts; any when None.
            case: the flows to the take that count; the longest of them is shown.
            by, detail: rows, as the query has them.
            internal: count messages on ROS's own topics, too.

        Raises:
            UsageError: not exactly one message, or one that does not exist or was not taken.
        """
        from msgflow.query.flow import find_take

        given = (publication_id, take_id, callback_instance_id, None, None)
        number, topic, run_id = self._ask(find_take, self._ask(_start, place, given, at, run))
        return self.query(
            "critical-path", run=run_id, take=number, from_=from_, to=[topic] if topic else None,
            case=case, by=by, detail=detail, internal=internal,
        )  # fmt: skip

    def flow_page(self, flow: Flow, path: str | Path) -> int:
        """Write the timeline of a flow into one file that any browser opens; return its bytes.

        The page draws the flow in its direction, up to its depth and limit, with ROS's own topics.

        Args:
            flow: the result of `flow`.
            path: the file; one that exists is replaced.

        Raises:
            UsageError: the file cannot be written.
        """
        from msgflow.view.flow_page import write_flow_page

        return self._ask(
            write_flow_page,
            Path(path),
            flow.run,
            *flow.start_key,
            direction=flow.direction,
            depth=flow.depth,
            limit=flow.limit,
        )

    def graph(self, *, internal: bool = False, **part: Unpack[SliceWords]) -> Graph:
        """Return the graph of nodes, topics, services and actions, for DOT, Mermaid or JSON.

        Args:
            internal: show ROS's own topics and services, too.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: not exactly one run, or a time that cannot be read.
        """
        from msgflow.export.graph import read_graph

        return self._ask(read_graph, Slice(**part), internal=internal)

    def compare(
        self,
        run_a: str | int | None = None,
        run_b: str | int | None = None,
        *,
        run: str | int | None = None,
        window: Sequence[str] = (),
        what: str = "paths",
        from_: str | None = None,
        to: str | None = None,
        case: str = "first",
        explain: bool = False,
        at_least: str = "5%",
        skip_first: float = 0.0,
        confidence: float = 0.95,
        resamples: int | None = None,
        seed: int = 0,
        internal: bool = False,
        max_depth: int = 32,
        max_paths: int = 1_000,
    ) -> Comparison:
        """Compare run B with run A, or two times of one run, with what chance explains.

        low and high enclose the difference with the given confidence. If both have the same sign,
        the verdict is that B is longer or shorter. This concerns chance within these two recordings
        only: it does not say how much the same system differs when it is started again.

        Args:
            run_a: baseline run: name, id, or label KEY=VALUE; several runs, with commas between
                them, count as one value each.
            run_b: run to compare with it, likewise.
            run: in place of both, the one run whose windows are compared.
            window (START..END): what counts of each side, such as 0s..60s.
            what: latency of 'paths' or between their 'ends', duration of 'callbacks', time from
                publication to take of 'topics'.
            from_: topics or nodes where paths start; globs.
            to: topics or nodes where paths end; globs.
            case: 'first' or 'last' arrival of each root, 'newest' root of each arrival, or
                'every_pair'.
            explain: what the changes of paths consist of, by node and part.
            at_least (CHANGE): less than that is about equal.
            skip_first: seconds of warm-up to leave out.
            confidence: of the intervals, between 0 and 1.
            resamples: behind the intervals, at least 20 / (1 - confidence), by default at least
                1000; 0 leaves out intervals and verdicts, which take longest.
            seed: of the resampling.
            internal: what ROS does for itself, too.
            max_depth: longest path, in topics.
            max_paths: most paths, shortest first.

        Raises:
            UsageError: a run, topic or choice that does not exist, or runs with nothing in common.
        """
        from msgflow.query.compare import compare

        return self._ask(
            compare,
            run_a,
            run_b,
            run=run,
            window=window,
            what=what,
            from_=from_,
            to=to,
            case=case,
            explain=explain,
            has_culprits=True,
            at_least=at_least,
            skip_first=skip_first,
            confidence=confidence,
            resamples=resamples,
            seed=seed,
            internal=internal,
            max_depth=max_depth,
            max_paths=max_paths,
        )

    def verify(
        self,
        targets: str | Path,
        *,
        paths: str | Path = DEFAULT_PATHS,
        case: str = "first",
        **part: Unpack[SliceWords],
    ) -> Verification:
        """Check a run against a file of requirements: passed, failed, not measured, no data.

        Args:
            targets: requirements, as YAML; docs/verify.md has their form.
            paths: the file with the paths that have names.
            case: the arrivals of paths that count: 'first', 'last', 'newest' or 'every_pair'.
            **part: what to read, see `msgflow.Slice`; one run.

        Returns:
            The verdicts: one row per requirement and measured thing of the run.

        Raises:
            UsageError: not such a file, no such run or time, or a name that nothing in the run has.
        """
        from msgflow.verify.targets_file import read_targets
        from msgflow.verify.verify import verify

        file = read_targets(Path(targets))
        chosen = Slice(**part)
        runs = self._ask(chosen.runs)
        places = named_places(
            file, Path(paths), lambda named, path: self._ask(named.require, runs, path)
        )
        found = self._ask(verify, file, chosen, paths=places, case=case)
        return replace(found, paths=str(paths))

    def suggest_targets(
        self,
        *,
        run: str | int | None = None,
        start: str | int | None = None,
        margin: float = 0.2,
    ) -> str:
        """Return the text of a file of requirements that a run meets, to review and change.

        Args:
            run, start: what to read, see `msgflow.Slice`; one run. Without a start, a warm-up of
                the run is left out, which the file says.
            margin: how much more than measured is allowed, as a share.

        Raises:
            UsageError: no such run, or a margin below 0.
        """
        from msgflow.query.compare import warm_up
        from msgflow.verify.suggested_targets import QUERIES, suggest_targets

        if not margin >= 0:
            raise UsageError(f"a margin is 0 or more — {margin}", "0.2 allows a fifth more")
        one = self._ask(Slice(run).one_run, "a file of requirements")
        skipped = self._ask(warm_up, one) if start is None else 0.0
        start = f"{skipped:g}s" if skipped else start
        ask = partial(self.query, run=one.run_id, start=start)
        results = {name: ask(name).to_arrow() for name in QUERIES}
        return suggest_targets(one, results, margin, skipped)

    def report(
        self,
        output: str | Path,
        *,
        compare: str | int | None = None,
        targets: str | Path | None = None,
        paths: str | Path = DEFAULT_PATHS,
        through: str | None = None,
        max_size: int = DEFAULT_REPORT_SIZE,
        **part: Unpack[SliceWords],
    ) -> Report:
        """Write the pages of a run, with their data, into one file that any browser opens.

        Args:
            output: the file; one that exists is replaced. If its name ends with .md, it gets the
                summary alone, as Markdown.
            compare: another run to compare it with.
            targets: requirements, as YAML: the summary has the verdicts on them.
            paths: the file with the paths that have names.
            through (NAME): only paths with this text in them: a topic, or a node.
            max_size: most bytes of the file; the page says what it leaves out to fit.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: no such run or path, nothing in the window, or a size that is too small.
        """
        from msgflow.view.report import write_report

        found = None if targets is None else self.verify(targets, paths=paths, **part)
        return self._ask(
            write_report,
            Path(output),
            Slice(**part),
            compare=compare,
            verification=found,
            through=through,
            max_size=max_size,
        )

    def sql(self, text: str, *, limit: int | None = DEFAULT_LIMIT) -> QueryResult:
        """Run SQL that only reads, without access to other files.

        Args:
            text: one query, or EXPLAIN of one.
            limit: most rows returned, all when None; a note says if there are more.

        Returns:
            The rows. Columns that Python or Parquet cannot hold (such as INTERVAL, UNION, or times
            after the year 9999) are text.

        Raises:
            UsageError: there is no SQL.
            QueryError: a statement that may do more than read, several statements, or one that the
                database could not run.
        """
        import duckdb

        from msgflow.sql.failure import in_words

        example = 'msgflow sql "SELECT * FROM run"'
        try:
            return guarded_rows(self.connection, text, example, limit)
        except duckdb.Error as error:
            raise in_words(error, self.path) or sql_error(error) from error

    def views(self) -> QueryResult:
        """Return the public views, a row each, with the number of columns and a sentence."""
        return self._ask(_rows_of, _VIEWS)

    def schema(self, view: str | None = None) -> QueryResult:
        """Return the columns of public views, a row each, with type and meaning.

        Args:
            view: its columns only; those of all when None.

        Raises:
            UsageError: there is no such view.
        """
        from msgflow.db.objects import public_names

        result = self._ask(_rows_of, _SCHEMA, view=view)
        if view is not None and not len(result):
            hint = did_you_mean(view, list(public_names()), "msgflow db schema lists them")
            raise UsageError(f"there is no such view — {view}", hint)
        return result

    def list_queries(self) -> tuple[Header, ...]:
        """Return the named queries, sorted by name."""
        return load_queries()

    def runs(self) -> tuple[Run, ...]:
        """Return the runs in the database, oldest first."""
        return self._ask(read_runs)

    def check(self) -> list[Finding]:
        """Return the broken rules of the database, as findings; a sound database breaks none."""
        from msgflow.db.finding import broken_rules

        return self._ask(broken_rules)

    def findings(self, *, run: str | int | None = None, detail: bool = False) -> list[Finding]:
        """Return what is wrong with a recording: errors, then warnings, with cause and cure.

        Args:
            run: 'all', a name or an id; the latest run when None.
            detail: also what is only worth knowing, and the rules that the database breaks now.
        """
        from msgflow.db.finding import read_findings

        runs = [one.run_id for one in self._ask(Slice(run).runs)]
        found = self._ask(read_findings, runs, info=detail)
        return [*self.check(), *found] if detail else found

    def clock_verdicts(
        self, *, run: str | int | None = None, only_several: bool = False
    ) -> list[str]:
        """Return a sentence per run: whether the times of its hosts can be compared.

        Args:
            run: 'all', a name or an id; the latest run when None.
            only_several: leave out runs with one clock, where nothing can be wrong.
        """
        from msgflow.query.notes import clock_verdicts

        runs = self._ask(Slice(run).runs)
        return self._ask(clock_verdicts, runs, only_several=only_several)

    def export_parquet(
        self,
        output: str | Path = "msgflow-parquet",
        views: Sequence[str] = (),
        *,
        run: str | int | None = "all",
        force: bool = False,
        **times: Unpack[TimeWords],
    ) -> tuple[ExportedView, ...]:
        """Write public views to DIR/VIEW/run_id=ID/data.parquet.

        If anything fails, nothing is written. The metadata of each file have the view, the schema
        revision and the version of msgflow. A time window selects what happened in it (links by
        their cause); objects, runs and traces are always written.

        Args:
            output (DIR): directory, created if missing.
            views (VIEW...): public views to export; all by default, see msgflow db schema.
            run: run to export.
            force: replace an earlier export of these views.
            **times: what to read, see `msgflow.Slice`.

        Raises:
            UsageError: a view, run or time that does not exist, or a file that does.
        """
        from msgflow.export.view_files import export_parquet

        return self._export(export_parquet, output, views, Slice(run, **times), force)

    def export_csv(
        self,
        output: str | Path = "msgflow-csv",
        views: Sequence[str] = (),
        *,
        run: str | int | None = "all",
        force: bool = False,
        **times: Unpack[TimeWords],
    ) -> tuple[ExportedView, ...]:
        """Write public views to DIR/VIEW.csv. If anything fails, nothing is written.

        Text is quoted; a missing value is an empty field without quotes. A time window selects what
        happened in it (links by their cause); objects, runs and traces are always written.

        Args:
            output (DIR): directory, created if missing.
            views (VIEW...): public views to export; all by default, see msgflow db schema.
            run: run to export.
            force: replace files that exist.
            **times: what to read, see `msgflow.Slice`.

        Raises:
            UsageError: a view, run or time that does not exist, or a file that does.
        """
        from msgflow.export.view_files import export_csv

        return self._export(export_csv, output, views, Slice(run, **times), force)

    def _export(
        self,
        write: Callable[..., tuple[ExportedView, ...]],
        output: str | Path,
        views: Sequence[str],
        part: Slice,
        force: bool,
    ) -> tuple[ExportedView, ...]:
        from msgflow.export.view_files import select_views

        selection = self._ask(select_views, views, part)
        return self._ask(write, Path(output), selection, force=force)

    def export_perfetto(
        self, output: str | Path = "msgflow.pftrace", **part: Unpack[SliceWords]
    ) -> PerfettoTrace:
        """Write a run as a trace for the Perfetto UI (ui.perfetto.dev, in the browser).

        Each thread is a track with its callbacks, publications, takes, requests and responses.
        Also: executor states, arrows for all links, gaps, events of your own tracepoints, samples
        of functions, and counters for rates and for messages not yet taken.

        Args:
            output: the file; one that exists is replaced.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: not exactly one run, a time that cannot be read, a file that cannot be
                written, or the package perfetto is not installed.
        """
        from msgflow.export.perfetto import write_perfetto

        return self._ask(write_perfetto, Path(output), Slice(**part))

    def export_folded(
        self, output: str | Path = "msgflow.folded", **part: Unpack[SliceWords]
    ) -> FoldedStacks:
        """Write which functions a run was in, as folded stacks: a flame graph of each callback.

        A line has node, callback and functions from the outermost on, with semicolons between, and
        how many samples saw that stack. What ran outside of callbacks stands below its process.

        Args:
            output: the file; one that exists is replaced.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: not exactly one run, none with samples, a time that cannot be read, or a
                file that cannot be written.
        """
        from msgflow.export.folded import write_folded

        return self._ask(write_folded, Path(output), Slice(**part))

    def export_timing_model(
        self, output: str | Path = "timing.yaml", **part: Unpack[SliceWords]
    ) -> TimingModel:
        """Write executors, callbacks and chains of a run as YAML, for analyses of response times.

        Callbacks have their periods, groups, distributions of duration and CPU time, and the
        longest observed response beside the bound of a single-threaded executor (Blaß et al., RTSS
        2021), with the longest observed durations.

        Args:
            output: the file; one that exists is replaced.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: not exactly one run, a time that cannot be read, or a file that cannot be
                written.
        """
        from msgflow.export.timing_model import write_timing_model

        return self._ask(write_timing_model, Path(output), Slice(**part))

    def export_mcap(
        self,
        output: str | Path = "msgflow.mcap",
        *,
        targets: str | Path | None = None,
        paths: str | Path = DEFAULT_PATHS,
        **part: Unpack[SliceWords],
    ) -> ExportedMcap:
        """Write measured values of a run for Foxglove, Lichtblick, PlotJuggler and Rerun.

        They show them beside the bag of the same drive. Topics below /msgflow have latency and age
        of paths, latency of topics, and duration and waits of callbacks, in milliseconds.
        /msgflow/log has a warning for each message that was dropped or lost.

        Args:
            output: the file; one that exists is replaced.
            targets: requirements, as YAML: each that is not met gets a message at the time of its
                worst case, or at the end if it has none.
            paths: the file with the paths that have names.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: not exactly one run, a time that cannot be read, a file that cannot be
                written, requirements that cannot be read, or the package mcap-ros2-support is not
                installed.
        """
        from msgflow.export.mcap import write_mcap

        violations = []
        if targets is not None:
            verdicts = self.verify(targets, paths=paths, **part)
            violations = [
                (
                    row["worst_at_ns"],
                    row["subject"] or row["target"],
                    f"{row['metric']} is {row['measured']}, required is {row['condition']}",
                )
                for row in verdicts.result.to_arrow().to_pylist()
                if row["verdict"] == "failed"
            ]
        return self._ask(write_mcap, Path(output), Slice(**part), violations)

    def export_otlp(
        self,
        output: str | Path = "msgflow-traces.json",
        *,
        from_: str | Sequence[str] | None = None,
        to: str | Sequence[str] | None = None,
        via: str | Sequence[str] | None = None,
        without: str | Sequence[str] | None = None,
        slowest: int | None = None,
        path: str | None = None,
        paths: str | Path = DEFAULT_PATHS,
        **part: Unpack[SliceWords],
    ) -> ExportedTraces:
        """Write a run as traces of OpenTelemetry, for Jaeger, Grafana Tempo and others.

        A trace is a root (a thing without a cause) and all that it led to: callbacks, publications,
        takes, requests and responses are spans, and further causes are links. If flows are chosen,
        a trace is a flow that reached the end of its path.

        Args:
            output: the file (OTLP/JSON, a request per line); one that exists is replaced.
            from_: topics or nodes where flows start; globs.
            to: topics or nodes where flows end; globs.
            via: topics, nodes and services that all flows visit.
            without: those that they do not visit.
            slowest: number of the slowest flows.
            path: number of a path, or its name in a file; in place of from, to, via and without.
            paths: the file with the paths that have names.
            **part: what to read, see `msgflow.Slice`; one run.

        Raises:
            UsageError: not exactly one run, a name or time that does not exist, or a file that
                cannot be written.
        """
        from msgflow.export.otlp import write_otlp

        words = {"from": from_, "to": to, "via": via, "without": without}
        choice: dict[str, Value] = {
            word: text if isinstance(text, str) else [*text] for word, text in words.items() if text
        }
        if path is not None:
            if choice:
                raise _path_and_others(path)
            named = self._ask(_words_of_path, path, Path(paths), Slice(**part))
            choice |= {word: [*names] for word, names in named.items()}
        if slowest is not None:
            choice["slowest"] = slowest
        return self._ask(write_otlp, Path(output), Slice(**part), choice or None)


def _words_of_path(
    connection: duckdb.DuckDBPyConnection, name: str, file: Path, part: Slice
) -> dict[str, list[str]]:
    from msgflow.paths.paths_file import read_paths

    runs = part.runs(connection)
    if name.isdecimal():
        return numbered_path(connection, runs, int(name))
    named = read_paths(file)
    path = named.named(name)
    named.require(connection, runs, path)
    return path.words()


def named_places(
    targets: TargetsFile, file: Path, require: Callable[[PathsFile, NamedPath], None] | None = None
) -> dict[str, dict[str, list[str]]]:
    """Return topics and nodes of the named paths of requirements; `require` may refuse a path."""
    from msgflow.paths.paths_file import read_paths

    called = [target.path_name for target in targets.targets if target.path_name is not None]
    if not called:
        return {}
    named = read_paths(file)
    found = {}
    for text in called:
        try:
            path = named.named(text.value)
        except UsageError as error:
            targets.file.fail(text.line, error.message, error.hint)
        if require is not None:
            require(named, path)
        found[text.value] = path.words()
    return found


def _path_and_others(path: str) -> UsageError:
    return UsageError(
        f"--path says where flows begin and end — {path}",
        "leave out --from, --to, --via and --without",
    )


def guarded_rows(
    connection: duckdb.DuckDBPyConnection, text: str, example: str, limit: int | None
) -> QueryResult:
    """Return the rows of a user's query, `limit` at most; see `guarded_query`.

    Raises:
        duckdb.Error: it is not SQL, or the database could not run it.
    """
    import duckdb

    from msgflow.db.sql_guard import guarded_query, in_own_lines
    from msgflow.result.query_result import QueryResult

    most = None if limit is None else limit + 1
    query = guarded_query(connection, text, example, most)
    try:
        table = interruptible(connection, lambda: _rows(connection, query), only_reads=True)
    except duckdb.Error as error:
        raise type(error)(in_own_lines(str(error))) from error
    if limit is None or table.num_rows <= limit:
        return QueryResult(table)
    note = f"only the first {limit} rows are shown; --limit raises that"
    return QueryResult(table.slice(0, limit), notes=[note])


def _rows_of(connection: duckdb.DuckDBPyConnection, /, query: str, **given: Value) -> QueryResult:
    from msgflow.result.query_result import QueryResult

    return QueryResult(connection.sql(query, params=given).to_arrow_table())


def _rows(connection: duckdb.DuckDBPyConnection, query: str) -> pa.Table:
    import duckdb

    from msgflow.result.plain import plain

    try:
        return plain(connection, connection.sql(query).to_arrow_table())
    except (duckdb.BinderException, duckdb.CatalogException):
        # A relation does not say in which line. Such an error comes before anything runs.
        connection.execute(query)
        raise


def sql_error(error: duckdb.Error, *more_memory: str) -> QueryError:
    """Return the error of a user's SQL in the words of DuckDB."""
    import duckdb

    from msgflow.sql.failure import first_line, out_of_memory

    if isinstance(error, duckdb.OutOfMemoryException):
        return out_of_memory("the SQL", *more_memory)
    if isinstance(error, duckdb.PermissionException):
        return QueryError(first_line(error), "SQL reaches no other files here; use DuckDB for that")
    if _WRITING_WITH.search(str(error)):
        # DuckDB sees the query as a subquery, and would advise to put the WITH where it is.
        return QueryError("not a statement that only reads — WITH", "SELECT in each part of WITH")
    # DuckDB says what is wrong, sometimes suggests a correction, and points at the place.
    what, *more = first_line(error), *str(error).strip().splitlines()[1:]
    place = next((at for at, line in enumerate(more) if line.startswith("LINE ")), len(more))
    hint = " ".join(line.strip() for line in more[:place] if line.strip())
    missing = _MISSING_TABLE.search(what)
    if missing and (meant := queries_meant(missing[1])):
        hint = f"it is a query: {' or '.join(query.command for query in meant)}"
    return QueryError("\n".join([what, *more[place:]]), hint or None)


def open_db(path: str | Path, *, memory_limit: str | None = None) -> Database:
    """Return the database at `path`; the first question opens it.

    Args:
        path: the file; the first ingest creates it.
        memory_limit: for DuckDB, such as '2GB'; when None it is `MSGFLOW_MEMORY_LIMIT` in the
            environment, or what msgflow chooses.
    """
    return Database(path, memory_limit=memory_limit)


def _start(
    connection: duckdb.DuckDBPyConnection,
    place: str | None,
    ids: Sequence[int | None],
    at: str | int | None,
    run: str | int | None,
) -> Start:
    """Return the start of a flow: a place and a time, or one of the ids, in the order of KINDS."""
    from msgflow.query.flow import KINDS, Start, find_start, require_start

    starts = [
        Start(kind, number) for kind, number in zip(KINDS, ids, strict=True) if number is not None
    ]
    if len(starts) + (place is not None) != 1:
        raise UsageError(
            "a flow starts from one thing: a topic or node, a publication, a take, a callback "
            "instance, a request or a response",
            "msgflow flow /chatter --at 2.5s, or msgflow flow --publication 1",
        )
    if starts and at is not None:
        raise UsageError("an identity has a time already", "leave out --at, or name a topic")
    if starts and run is not None:
        found = require_start(connection, starts[0])
        asked = Slice(run).one_run(connection, "a flow")
        if found != asked:
            raise UsageError(
                f"{starts[0].kind} {starts[0].id} is not of run {asked.title}",
                f"it is of run {found.title}: leave out --run",
            )
    return starts[0] if place is None else find_start(connection, place, at, run)

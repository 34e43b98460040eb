"""A Babeltrace 2 graph: a source per trace directory, a muxer, a sink that hands messages over."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from msgflow.errors import TraceError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from msgflow.trace.bt2_library import Bt2Library
    from msgflow.trace.model import TraceInfo

_ADDRESS = re.compile(r"[\w-]*addr=0x[0-9a-f]+,?")

# Message ranges fetched per step: enough to make the step's cost vanish, few enough that the
# messages (recycled by the library) stay in the processor's cache.
_RANGES_PER_STEP = 8


class Bt2Graph:
    """The messages of several traces, in time order.

    Each directory has its own source, so that directories of equal trace uuid are not merged.
    The trace objects are named by their index, which is how a stream is led back to its trace.

    Attributes:
        stream_count: number of data streams of all traces.
    """

    def __init__(self, library: Bt2Library, traces: Sequence[TraceInfo]) -> None:
        self._library = library
        paths = self._paths = [trace.path for trace in traces]
        bt2 = library.bt2
        self._native = library.native
        source_class = plugin_class(library, "ctf", "source", "fs")
        muxer_class = plugin_class(library, "utils", "filter", "muxer")
        self._graph: Any = bt2.Graph(0)
        muxer = self._graph.add_component(muxer_class, "muxer")
        self.stream_count = 0
        for index, (path, trace) in enumerate(zip(paths, traces, strict=True)):
            parameters = source_parameters(path) | {
                "trace-name": str(index),
                "clock-class-offset-ns": trace.clock_correction_ns,
            }
            try:
                source = self._graph.add_component(source_class, str(index), parameters)
            except bt2._Error as error:
                raise damaged_error(path, error) from error
            for port in list(source.output_ports.values()):
                free = next(p for p in muxer.input_ports.values() if not p.is_connected)
                self._graph.connect_ports(port, free)
                self.stream_count += 1
        self._mailbox: list[Any] = []
        sink_class = _sink_class(library)
        sink = self._graph.add_component(sink_class, "sink", obj=self._mailbox)
        self._graph.connect_ports(muxer.output_ports["out"], sink.input_ports["in"])

    def steps(self) -> Iterator[list[Any]]:
        """Yield lists of pointers to messages, each owning a reference that the caller gives back.

        The list is emptied and used again at the next step.

        Raises:
            TraceError: a stream cannot be decoded any further.
            KeyboardInterrupt: the user stopped the reading.
        """
        mailbox = self._mailbox
        run_once = self._graph.run_once
        bt2 = self._library.bt2
        while True:
            try:
                run_once()
            except bt2.Stop:
                yield mailbox
                mailbox.clear()
                return
            except bt2._Error as error:
                # An exception raised in the sink, called from C, arrives as text.
                if "KeyboardInterrupt" in str(error):
                    raise KeyboardInterrupt from None
                yield mailbox
                mailbox.clear()
                raise damaged_error(_path_of(error, self._paths), error) from error
            yield mailbox
            mailbox.clear()

    def close(self) -> None:
        """Give the graph back. Messages still held by the caller must have been given back."""
        put = self._native.message_put_ref
        for message in self._mailbox:
            put(message)
        self._mailbox.clear()
        self._graph = None


def plugin_class(library: Bt2Library, plugin: str, kind: str, name: str) -> Any:
    """Return a component class of one of Babeltrace's own plugins.

    Raises:
        TraceError: the plugin is not installed.
    """
    found = library.bt2.find_plugin(plugin)
    classes = getattr(found, f"{kind}_component_classes") if found is not None else {}
    if name not in classes:
        raise TraceError(
            f"Babeltrace 2 is installed without its plugin {plugin!r}",
            hint="apt install libbabeltrace2-0 --reinstall",
        )
    return classes[name]


def source_parameters(path: Path) -> dict[str, Any]:
    """Return the parameters with which `src.ctf.fs` reads the trace at `path`.

    Clocks are taken to count from the epoch: LTTng's do, and traces of several clocks could not
    be put in one order otherwise.
    """
    return {"inputs": [str(path)], "force-clock-class-origin-unix-epoch": True}


def damaged_error(path: Path | None, error: Any) -> TraceError:
    """Put the innermost cause that Babeltrace names into one sentence."""
    cause = " ".join(_ADDRESS.sub("", error[0].message).split()).rstrip(".,: ")
    where = f" — {path}" if path is not None else ""
    return TraceError(
        f"the trace is damaged or incomplete: {cause}{where}",
        hint=f"copy it again from where it was recorded; babeltrace2 {path or 'TRACE'} says more",
    )


def _path_of(error: Any, paths: Sequence[Path]) -> Path | None:
    """Find the trace by the name of the source component among the causes."""
    for cause in error:
        name = getattr(cause, "component_name", None)
        if name is not None and name.isdigit() and int(name) < len(paths):
            return paths[int(name)]
    return None


def _sink_class(library: Bt2Library) -> Any:
    bt2 = library.bt2
    native = library.native
    next_range = native.bt2_self_component_port_input_get_msg_range
    end = getattr(native, "__BT_FUNC_STATUS_END")
    ok = getattr(native, "__BT_FUNC_STATUS_OK")

    class MailboxSink(bt2._UserSinkComponent):  # type: ignore[misc, name-defined]
        """Puts the pointers of messages, with their references, into the given list."""

        def __init__(self, config: Any, params: Any, mailbox: list[Any]) -> None:
            self._mailbox = mailbox
            self._add_input_port("in")

        def _user_graph_is_configured(self) -> None:
            self._iterator = self._create_message_iterator(self._input_ports["in"])

        def _user_consume(self) -> None:
            pointer = self._iterator._ptr
            for _ in range(_RANGES_PER_STEP):
                status, messages = next_range(pointer)
                if status != ok:
                    if status == end:
                        raise bt2.Stop
                    raise bt2._Error("cannot advance the message iterator")
                self._mailbox.extend(messages)

    return MailboxSink

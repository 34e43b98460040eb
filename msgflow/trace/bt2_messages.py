"""Messages of Babeltrace 2: from traces, one after the other in order of time."""

from __future__ import annotations

import re
import shlex
from typing import TYPE_CHECKING, Any

from msgflow.errors import TraceError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

_QUOTED_PATH = re.compile(r"[`'](/[^`']+)[`']")
_ADDRESS = re.compile(r"[\w-]*addr=0x[0-9a-f]+,?")


def messages(bt2: Any, traces: Sequence[tuple[Path, int]]) -> Iterator[Any]:
    """Yield the messages of traces; each is a directory and a correction of its clock [ns].

    A directory has a source of its own: one source would merge directories of one trace uuid.
    The name of a trace object ends with the place of the trace in `traces`.
    """
    source = bt2.ComponentSpec.from_named_plugin_and_component_class
    parameters = [parameters_of(path, place, ns) for place, (path, ns) in enumerate(traces)]
    try:
        yield from bt2.TraceCollectionMessageIterator([source("ctf", "fs", p) for p in parameters])
    except bt2._Error as error:
        # Babeltrace turns an exception that Python raised in between into text.
        if "KeyboardInterrupt" in str(error):
            raise KeyboardInterrupt from None
        # The components are named fs, fs-1, fs-2 and so on.
        names = [getattr(cause, "component_name", None) or "" for cause in error]
        places = [int(name[3:] or 0) for name in names if re.fullmatch(r"fs(-\d+)?", name)]
        path = traces[places[0]][0] if places else "TRACE"
        cause = " ".join(_ADDRESS.sub("", error[0].message).split()).rstrip(".,: ")
        named = [match[1] for each in error for match in _QUOTED_PATH.finditer(each.message)]
        raise TraceError(
            f"the trace is damaged or incomplete: {cause} — {named[0] if named else path}",
            hint="copy it again from where it was recorded;"
            f" babeltrace2 {shlex.quote(str(path))} says more",
        ) from error


def parameters_of(path: Path, place: int = 0, correction_ns: int = 0) -> dict[str, Any]:
    """Return the parameters with which `source.ctf.fs` reads a trace; see `messages`.

    The clocks are said to count from the epoch, which LTTng's do: Babeltrace orders traces of
    several clocks only then.
    """
    return {
        "inputs": [str(path)],
        "trace-name": f"{place:09}",
        "clock-class-offset-ns": correction_ns,
        "force-clock-class-origin-unix-epoch": True,
    }

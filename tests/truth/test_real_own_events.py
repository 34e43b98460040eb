"""The tracepoint of docs/own-events.md, compiled, recorded with LTTng and loaded."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import duckdb
import pytest
from recording.recorder import NotPossibleError, require_lttng, session
from recording.tracetools import build_tracetools

from msgflow.ingest import ingest

PAGE = Path(__file__).parents[2] / "docs" / "own-events.md"
FILE = re.compile(r"^```c\n/\* (my_pkg_tp\.[hc]) \*/\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# In a callback, in one nested in it, behind that one, and behind both.
PROGRAM = r"""
#include <stdbool.h>
#include "my_pkg_tp.h"
void ros_trace_rcl_init(const void *);
void ros_trace_callback_start(const void *, bool);
void ros_trace_callback_end(const void *);
static void *outer = (void *)0x1000, *inner = (void *)0x2000;
static void done(uint64_t frame, const char *label)
{
    lttng_ust_tracepoint(my_pkg, frame_done, frame, frame / 4.0, label);
}
int main(void)
{
    ros_trace_rcl_init(&outer);
    for (uint64_t n = 0; n < 100; n++) {
        ros_trace_callback_start(outer, false);
        done(4 * n, "outer");
        ros_trace_callback_start(inner, false);
        done(4 * n + 1, "inner \303\244");
        ros_trace_callback_end(inner);
        done(4 * n + 2, "");
        ros_trace_callback_end(outer);
        done(UINT64_MAX - n, "no \xff text");
    }
}
"""
READ = """
SELECT c.callback_handle, u.fields
FROM user_event AS u
LEFT JOIN callback_instance AS i USING (callback_instance_id)
LEFT JOIN callback AS c USING (callback_id)
ORDER BY u.user_event_id
"""
EVENT = re.compile(r"my_pkg:frame_done:.*\{ frame = (\d+), score = ([\d.e+]+), label = \"(.*)\" \}")


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    try:
        require_lttng()
    except NotPossibleError as error:
        pytest.skip(f"cannot record: {error}")
    files = dict(FILE.findall(PAGE.read_text(encoding="utf-8")))
    assert sorted(files) == ["my_pkg_tp.c", "my_pkg_tp.h"]
    for name, content in {**files, "main.c": PROGRAM}.items():
        (tmp_path / name).write_text(content)
    library = build_tracetools(tmp_path)
    command = ["gcc", "-I.", "-o", "program", "main.c", "my_pkg_tp.c", str(library), "-llttng-ust"]
    subprocess.run([*command, f"-Wl,-rpath,{tmp_path}"], cwd=tmp_path, check=True)
    with session(tmp_path / "trace"):
        subprocess.run([tmp_path / "program"], env={"LTTNG_UST_REGISTER_TIMEOUT": "-1"}, check=True)
    return tmp_path / "trace"


@pytest.mark.thorough
def test_every_event_is_there_with_its_fields_and_its_callback(trace: Path, tmp_path: Path) -> None:
    ingest([trace], tmp_path / "run.duckdb", events=["my_pkg:*"])
    with duckdb.connect(str(tmp_path / "run.duckdb"), read_only=True) as connection:
        found = [
            (handle, json.loads(fields)) for handle, fields in connection.execute(READ).fetchall()
        ]
    expected = [
        (callback, {"frame": frame, "score": frame / 4, "label": label})
        for n in range(100)
        for callback, frame, label in (
            (0x1000, 4 * n, "outer"),
            (0x2000, 4 * n + 1, "inner ä"),
            (0x1000, 4 * n + 2, ""),
            (None, 2**64 - 1 - n, "no \N{REPLACEMENT CHARACTER} text"),
        )
    ]
    assert found == expected
    if shutil.which("babeltrace2"):
        shown = subprocess.run(["babeltrace2", trace], capture_output=True, check=True).stdout
        events = EVENT.findall(shown.decode("utf-8", "replace"))
        assert [(int(frame), float(score)) for frame, score, _ in events] == [
            (fields["frame"], pytest.approx(fields["score"], rel=1e-5)) for _, fields in found
        ]
        # Babeltrace before 2.0.5 shows the text of an earlier event in place of an empty one.
        assert [label for *_, label in events if label] == [
            fields["label"] or label
            for (_, fields), (*_, label) in zip(found, events, strict=True)
            if label
        ]

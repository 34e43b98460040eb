"""The file with declared links: its form, and the line of every mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from msgflow.errors import UsageError
from msgflow.links.links_file import read_links
from msgflow.links.suggested_links import LinkSuggestions

GOOD = """# ours
links:
  - kind: partial_sync
    node: /fusion
    inputs:
      - /a
      - "*_raw"
    outputs: /c
    process: 42
"""


QUEUE = """links:
  - kind: queue
    node: /slam
    inputs: [/image]
    outputs: [/pose]
    depth: 2
"""


def write(tmp_path: Path, text: str | bytes) -> Path:
    path = tmp_path / "links.yaml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_entries_know_their_lines(tmp_path: Path) -> None:
    (link,) = read_links(write(tmp_path, GOOD)).links
    assert (link.kind, link.node.value, link.node.line, link.line) == (
        "partial_sync",
        "/fusion",
        4,
        3,
    )
    assert [(text.value, text.line) for text in link.inputs] == [("/a", 6), ("*_raw", 7)]
    assert [text.value for text in link.outputs] == ["/c"]
    assert link.process is not None
    assert link.process.value == "42"
    assert link.host is None


def test_no_links_at_all(tmp_path: Path) -> None:
    assert read_links(write(tmp_path, "links: []")).links == ()
    assert read_links(write(tmp_path, "links:\n")).links == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the file is empty"),
        ("# nothing\n", "line 1: the file is empty"),
        ("[1, 2]", "line 1: the file is not a mapping with links"),
        ("links: 3", "line 1: links is not a list"),
        ("links: []\nlinsk: []", "line 2: the file has no linsk"),
        ("links: []\nlinks: []", "line 2: links is given twice"),
        ("links:\n  - just text", "line 2: a link is not a mapping"),
        ("links:\n  - kind: partial_sync\n    node: /a", "line 2: a link lacks inputs"),
        (GOOD.replace("node:", "nodes:"), "line 4: a link has no nodes"),
        (GOOD.replace("node: /fusion", "node:"), "line 4: node has no value"),
        (GOOD.replace("node: /fusion", "node: [/a, /b]"), "line 4: node is not a name"),
        (GOOD.replace("outputs: /c", "outputs: []"), "line 8: outputs is empty"),
        (GOOD.replace("- /a", "- {a: b}"), "line 6: inputs is not a name"),
        (GOOD.replace("partial_sync", "sync"), "line 3: no such kind of link — sync"),
        (GOOD.replace('"*_raw"', "*_raw"), "line 7: "),
        (GOOD + "    depth: 2", "line 10: only a queue has a depth — partial_sync"),
        (QUEUE.replace("2", "0"), "line 6: a depth is a number from 1 — 0"),
        ("links: [", "line 1: "),
        ("links: &all [*all]", "line 1: "),
        ("a: b: c", "line 1: "),
        ("links: []\n---\nlinks: []", "line "),
        ("links: \x00", "links.yaml"),
    ],
)
def test_mistakes_have_their_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        read_links(write(tmp_path, text))
    assert message in caught.value.message


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    for path, message in (
        (tmp_path / "none.yaml", "no such file or directory"),
        (tmp_path, "a directory, no file"),
        (write(tmp_path, b"\xff\xfe\x00links"), "not a text file in UTF-8"),
    ):
        with pytest.raises(UsageError) as caught:
            read_links(path)
        assert message in caught.value.message


def test_suggestions_can_be_read_back(tmp_path: Path) -> None:
    """With names that mean something else in YAML, and the evidence as comments."""
    row = {
        "kind": "periodic_async",
        "node": "/no",
        "inputs": ["/a", "yes", "x: y"],
        "outputs": ["/c#d"],
        "evidence": "its timer\npublished " + "much " * 60,
        "doubt": "the node also receives\n- /x",
        "process": "fusion",
        "pid": 42,
        "host": "true",
        "is_name_repeated": True,
    }
    certain = row | {"doubt": None}
    queue = row | {"kind": "queue", "queue_depth": 2, "is_name_repeated": False}
    kept = row | {"kind": "independent", "inputs_of": "/tf_listener", "is_name_repeated": False}
    suggestions = LinkSuggestions((), [row, certain], [kept, queue])
    assert (suggestions.certain, suggestions.doubtful) == ([certain], [row])
    text = suggestions.text("msgflow links apply FILE")
    assert "  # Doubtful: the node also receives - /x." in text.splitlines()
    assert max(map(len, text.splitlines())) <= 80
    declared, bounded, link = read_links(write(tmp_path, text)).links
    assert (bounded.kind, bounded.depth, link.depth) == ("queue", 2, None)
    assert (declared.kind, declared.process) == ("independent", None)
    assert declared.inputs_of is not None
    assert declared.inputs_of.value == "/tf_listener"
    assert link.node.value == "/no"
    assert [item.value for item in link.inputs] == row["inputs"]
    assert [item.value for item in link.outputs] == row["outputs"]
    assert (link.process and link.process.value, link.host and link.host.value) == ("42", "true")
    assert read_links(write(tmp_path, LinkSuggestions((), []).text("x"))).links == ()


def test_a_doubtful_entry_is_a_comment_that_becomes_an_entry(tmp_path: Path) -> None:
    row = {
        "kind": "partial_sync",
        "node": "/fusion",
        "inputs": [f"/a/long/name/of/a/topic/{number}" for number in range(6)],
        "outputs": ["/c"],
        "evidence": "none",
        "doubt": "some",
        "is_name_repeated": False,
    }
    text = LinkSuggestions((), [row]).text("x")
    assert max(map(len, text.splitlines())) <= 80
    assert read_links(write(tmp_path, text)).links == ()
    head, entry = text.split("  # Doubtful: some.\n")
    (link,) = read_links(write(tmp_path, head + entry.replace("# ", ""))).links
    assert [item.value for item in link.inputs] == row["inputs"]

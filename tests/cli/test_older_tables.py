"""A database whose tables another version of msgflow made: each command says what to do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

ROOT = Path(__file__).resolve().parents[2]
TARGETS = "targets:\n  - topic: /chatter\n    rate: '< 1000 Hz'\n"
COMMANDS = (
    "check",
    "clocks",
    "clocks apply none",
    "compare",
    "db schema",
    "db upgrade",
    "export csv -o out",
    "export folded -o out.folded",
    "export mcap -o out.mcap",
    "export otlp -o out.json",
    "export parquet -o out",
    "export perfetto -o out.json",
    "flow /chatter",
    "graph",
    "info",
    "info --section findings",
    "ingest TRACE",
    "links",
    "links apply LINKS",
    "query e2e-latency",
    "report -o out.html",
    "runs",
    "runs remove pipeline",
    "sql SELECT\u00a01",
    "suggest links",
    "suggest paths",
    "suggest targets",
    "ui --no-browser",
    "verify TARGETS",
    "why",
)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_says_how_to_read_the_recording_again(
    msgflow: Callable[..., Result], older_database: Path, tmp_path: Path, command: str
) -> None:
    content = older_database.read_bytes()
    targets, links = tmp_path / "targets.yaml", tmp_path / "links.yaml"
    targets.write_text(TARGETS)
    links.write_text("links: []\n")
    trace = ROOT / "examples" / "pipeline.tar.xz"
    given = {"TRACE": str(trace), "LINKS": str(links), "TARGETS": str(targets)}
    words = [given.get(word, word.replace("\u00a0", " ")) for word in command.split(" ")]
    refused = msgflow(*words, "--db", older_database)
    assert refused.exit_code == 4, refused.output
    said = f"not as this msgflow makes it: it has another table store.callback — {older_database}"
    assert said in refused.stderr
    hint = "msgflow ingest TRACE --db NEW.duckdb reads the recording again"
    assert refused.stderr.endswith(f"\n\nhint: {hint}\n")
    assert older_database.read_bytes() == content

"""What changes would do to a run: the page "What if" of `msgflow ui`."""

from __future__ import annotations

import contextlib
import json
import tempfile
import threading
from pathlib import Path

from msgflow.db.connection import connect
from msgflow.errors import UsageError
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.query.why import explain
from msgflow.replay.change import Change, changed, read_change, require_effect
from msgflow.replay.engine import Replay
from msgflow.replay.predict import Predictor
from msgflow.replay.predicted_run import write_predicted
from msgflow.replay.remedies import predicted_paths
from msgflow.run.slice import Slice
from msgflow.view.page_query import Question
from msgflow.view.table_encoding import encode, encode_result


class WhatIf:
    """Replays of the run that was asked for last, which is read once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._run_id: int | None = None
        self._predictor: Predictor | None = None

    def remedies(self, asked: Question) -> bytes:
        """Return what may make data sooner: what a page has controls for."""
        found = explain(asked.connection, asked.run, Slice(asked.run.run_id))
        return encode(found.candidates, units={"blamed_ns": "ns"})

    def paths(self, asked: Question) -> bytes:
        """Return what changes do to each path."""
        predictor, changes = self._asked(asked)
        result = predicted_paths(asked.connection, asked.run, predictor, changes, None)
        return encode_result(result, {}, asked.origin_ns)

    def parts(self, asked: Question) -> bytes:
        """Return what the latency of each path consists of with changes, as `path-breakdown`."""
        predictor, changes = self._asked(asked)
        system = changed(predictor.system, changes)
        replay = Replay(system)
        replay.latencies()
        with tempfile.TemporaryDirectory(prefix="msgflow-") as folder:
            file = Path(folder) / "predicted.duckdb"
            write_predicted(
                asked.connection, asked.run, system, replay, changes, file, only_predicted=True
            )
            with contextlib.closing(connect(file, read_only=True)) as predicted:
                result = run_query(predicted, load_query("path-breakdown"), {})
        return encode_result(result, {}, asked.origin_ns)

    def _asked(self, asked: Question) -> tuple[Predictor, list[Change]]:
        try:
            texts = json.loads(asked.text("changes"))
        except (ValueError, RecursionError):
            texts = None
        if not isinstance(texts, list) or not all(isinstance(one, str) for one in texts):
            raise UsageError(f"changes are a list of texts — {asked.params.get('changes')}")
        changes = [read_change(text) for text in texts]
        with self._lock:
            if self._predictor is None or self._run_id != asked.run.run_id:
                self._predictor = Predictor(asked.connection, asked.run)
                self._run_id = asked.run.run_id
            predictor = self._predictor
            for change in changes:
                require_effect(predictor.system, change)
        return predictor, changes

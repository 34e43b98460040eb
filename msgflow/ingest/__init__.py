"""From traces to a run in a database: staging, model, store, links."""

from __future__ import annotations

from msgflow.ingest.ingest import Diagnostic, IngestProgress, IngestReport, ingest

__all__ = ["Diagnostic", "IngestProgress", "IngestReport", "ingest"]

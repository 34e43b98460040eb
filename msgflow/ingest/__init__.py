"""From traces to a run in a database: staging, model, store, links."""

from __future__ import annotations

from msgflow.ingest.ingest import IngestProgress, IngestReport, ingest

__all__ = ["IngestProgress", "IngestReport", "ingest"]

"""Indirect links that a file declares: read, matched to the nodes of a run, stored, suggested."""

from __future__ import annotations

from msgflow.links.annotations import AppliedLinks, apply_links, declare_links
from msgflow.links.links_file import DeclaredLink, LinksFile, read_links
from msgflow.links.suggested_links import LinkSuggestions

__all__ = [
    "AppliedLinks",
    "DeclaredLink",
    "LinkSuggestions",
    "LinksFile",
    "apply_links",
    "declare_links",
    "read_links",
]

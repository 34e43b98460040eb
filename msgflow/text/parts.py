"""Parts of a latency, as an engineer says them: on screens, on pages and in docs/glossary.md.

Files, `--wide` and SQL have the names.
"""

from __future__ import annotations

PART_COLUMNS = ("part", "activity")
"""Columns of named queries that have the names of parts."""
WORDS = {
    "network_or_idle": "way or idle",
    "until_arrival": "on the way",
    "undecided": "way or queue",
    "executor_busy": "in the queue",
    "all_threads_busy": "waits for a thread",
    "blocked": "group is busy",
    "executor": "in the executor",
    "run_queue": "waits for a CPU",
    "request_to_take": "request to its take",
    "response_to_take": "answer to its take",
    "cache": "in the cache",
    "timer": "waits for timer",
    "unpublished": "waits for input",
    **{layer: f"publish ({layer})" for layer in ("intra", "rclcpp", "rcl", "rmw", "dds")},
}
"""By name, those whose names people would not say."""


def part_words(name: str) -> str:
    """Return the words for a part."""
    return WORDS.get(name, name.replace("_", " "))

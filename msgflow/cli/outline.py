"""What the help of `msgflow` says of each command, so that it need not import them all."""

from __future__ import annotations

from typer.core import TyperCommand

SUMMARIES = {
    "ingest": "Read LTTng traces of a ROS 2 system into a database, as one run.",
    "query": "Run a named query; `msgflow query NAME --help` explains it.",
    "flow": "Print the flow of one message: what caused it, and what it caused.",
    "graph": "Write the graph of nodes, topics and services, with rates and latencies.",
    "ui": "Show the database in the browser: timeline, paths, graph, executors, comparison.",
    "report": "Write the pages of a run to one file that any browser opens, without a server.",
    "compare": (
        "Compare run B with run A: medians, means, percentiles, and whether it may be chance."
    ),
    "verify": "Check a run against the requirements of a file: passed, failed, or not measured.",
    "sql": "Run SQL on the public views, read-only and without access to other files.",
    "info": (
        "Print what a database holds: runs, hosts, processes, nodes, topics, counts, data quality."
    ),
    "check": "Show what is wrong with a recording, with cause and cure; exit code 1 on errors.",
    "events": "List the events of any CTF traces in order of time.",
    "targets": "Write requirements for verify.",
    "runs": "List, rename, label and remove runs; without a command: list.",
    "links": "Declare indirect links: how nodes use messages that they keep.",
    "paths": "Give paths names, for --path.",
    "clocks": "Synchronise the clocks of several hosts; without a command: show.",
    "export": "Write the content of a database to files.",
    "db": "Check, upgrade and describe a database file.",
    "fleet": "Many recordings, on one machine or many, into one lake of Parquet files.",
    "mcp": "Serve the database to an agent, over stdin and stdout (Model Context Protocol).",
    "simulate": "Write the trace of a simulated ROS 2 system, and the links that really happened.",
}
"""Commands in the order in which a user needs them, and the first sentence of the help of each."""

OUTLINES = {name: TyperCommand(name, help=summary) for name, summary in SUMMARIES.items()}
"""Commands as far as a list of them tells."""

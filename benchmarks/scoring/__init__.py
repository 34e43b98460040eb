"""Compares what msgflow has found in a trace with what is true of the traced system.

Truth comes from simulations or, as `truth.jsonl.gz`, with recorded traces. Both are brought into
the same shape, so that one comparison serves all kinds of links: `truth_time` names instances
(publications, takes, runs of callbacks, requests, responses) by place and time, `truth_link` has
what is linked and whether the trace decides it. The thinking is in the `.sql` files.
"""

from __future__ import annotations

from scoring.compare import Drop, Score, compare_real, compare_recorded, compare_simulated

__all__ = ["Drop", "Score", "compare_real", "compare_recorded", "compare_simulated"]

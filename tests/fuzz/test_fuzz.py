"""A fixed slice of `make fuzz`: nothing that is damaged ends in anything but a clear answer."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
SEED = 1
COUNT = 20
CAMPAIGN = """
import json, sys
import fuzz
found = fuzz.campaign(range(int(sys.argv[1])), int(sys.argv[2]))
print(json.dumps([[o.number, o.ending, o.bad, o.change, o.said[-500:]] for o in found]))
"""


def test_a_slice_of_the_campaign() -> None:
    # In a process of its own: cases are forked from it, and what pytest has loaded would count
    # against their limits.
    ran = subprocess.run(
        [sys.executable, "-c", CAMPAIGN, str(COUNT), str(SEED)],
        cwd=BENCHMARKS,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr[-2000:]
    found = json.loads(ran.stdout.splitlines()[-1])
    assert sorted(number for number, *_ in found) == list(range(COUNT))
    assert {ending for _, ending, *_ in found} >= {"ended", "refused"}
    assert [outcome for outcome in found if outcome[2]] == []

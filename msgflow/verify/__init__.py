"""Requirements on a run: the file that lists them, and the verdicts."""

from msgflow.verify.targets_file import TargetsFile, read_targets
from msgflow.verify.verify import Verdict, Verification, verify
from msgflow.verify.worst_case import take_of

__all__ = ["TargetsFile", "Verdict", "Verification", "read_targets", "take_of", "verify"]

"""Requirements on a run: the file that lists them, and the verdicts."""

from msgflow.verify.file import TargetsFile, read_targets
from msgflow.verify.verify import Verdict, Verification, verify

__all__ = ["TargetsFile", "Verdict", "Verification", "read_targets", "verify"]

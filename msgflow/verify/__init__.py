"""Requirements on a run: a file that says what has to be, and whether it is."""

from msgflow.verify.file import TargetsFile, read_targets
from msgflow.verify.verify import Verdict, Verification, verify

__all__ = ["TargetsFile", "Verdict", "Verification", "read_targets", "verify"]

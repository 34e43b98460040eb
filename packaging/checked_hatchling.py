"""Builds with hatchling, after a look at the Python that asks for it.

pip compares the version of Python with `requires-python` only after it has searched for every
dependency, and where one of them has no release for an old Python it ends with pages about that.
"""

import sys

from hatchling.build import *  # noqa: F403

if sys.version_info < (3, 11):  # noqa: UP036
    sys.exit(
        "msgflow needs Python 3.11 or newer; this is Python {}.{}.\n".format(*sys.version_info[:2])
        + "A newer one beside it will do, and needs no root:  uv tool install --python 3.12 ."
    )

"""Build backend: hatchling, after a check of the version of Python.

pip searches for all dependencies before it compares the version of Python with `requires-python`.
On Python 3.8, which Ubuntu 20.04 has, it ends with pages about a dependency that has no release
for that Python.
"""

import sys

from hatchling.build import *  # noqa: F403

if sys.version_info < (3, 10):  # noqa: UP036
    sys.exit(
        "msgflow needs Python 3.10 or newer; this is Python {}.{}.\n".format(*sys.version_info[:2])
        + "A newer one beside it will do, and needs no root:  uv tool install --python 3.12 ."
    )

"""The browser in which pages are looked at: Chromium without a window."""

from __future__ import annotations

import shutil

# In the one that has no windows, tests of pages take a third less processor time.
_NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "chrome")

# The sandbox of Chromium needs rights that test machines do not give; nothing foreign is opened.
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]


def find_browser() -> str | None:
    """Return the path of a Chromium of this machine, None where there is none."""
    return next(filter(None, map(shutil.which, _NAMES)), None)

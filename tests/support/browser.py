"""Chromium without a window: the browser of the tests of pages."""

from __future__ import annotations

import shutil

# The one without windows needs a third less processor time.
_NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "chrome")

# The sandbox of Chromium needs rights that test machines do not give; nothing foreign is opened.
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]


def find_browser() -> str | None:
    """Return the path of a Chromium of this machine; None if it has no Chromium."""
    return next(filter(None, map(shutil.which, _NAMES)), None)

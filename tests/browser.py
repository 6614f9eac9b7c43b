"""A real browser without a window, for tests of pages.

It is the one that EXCITE_BROWSER names, or the first of the usual names on the path.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_OFFLINE = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")


@contextmanager
def started_browser() -> Iterator[Any]:
    """A browser of playwright; the test is skipped where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    named = os.environ.get("EXCITE_BROWSER")
    path = named or next((path for path in map(shutil.which, _NAMES) if path), None)
    if path is None:
        pytest.skip(f"no browser: none of {', '.join(_NAMES)} is there, and no EXCITE_BROWSER")
    with playwright.sync_playwright() as library:
        started = library.chromium.launch(executable_path=path, args=list(_OFFLINE))
        yield started
        started.close()

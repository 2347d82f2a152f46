# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A deprecation that our own code causes fails the run; those of Blender's scripts and of other packages are only
shown.

They are counted, not raised where they happen: Blender goes on with such an exception set, and names another place or
none.
"""

import warnings
from pathlib import Path

import pytest

OURS = {"core", "wildcap_addon", "research", "tests"}
DEPRECATIONS = DeprecationWarning, PendingDeprecationWarning, FutureWarning
FORKED = "use of fork() may lead to deadlocks"
"""Of Python 3.12 and newer beside other threads, as pytest-xdist has them. Nothing is to be removed, and those who fork
here do so to be killed."""


class Watch:
    """A plugin of pytest for the checkout `root`."""

    def __init__(self, root: Path):
        self.root = root.resolve()
        self.found: dict[tuple[str, int], str] = {}

    def pytest_warning_recorded(self, warning_message: warnings.WarningMessage) -> None:
        path = Path(warning_message.filename).resolve()  # the extension is a link to the checkout
        if not issubclass(warning_message.category, DEPRECATIONS) or FORKED in str(warning_message.message):
            return
        if path.is_relative_to(self.root) and path.relative_to(self.root).parts[0] in OURS:
            self.found[str(path.relative_to(self.root)), warning_message.lineno] = str(warning_message.message)

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if self.found and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter) -> None:
        if self.found:
            terminalreporter.section("deprecations that our code causes: the run failed", red=True)
        for (path, line), message in sorted(self.found.items()):
            terminalreporter.line(f"{path}:{line}: {message}")

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tests of research run with the hooks and fixtures of the product's."""

from tests.conftest import *  # noqa: F403

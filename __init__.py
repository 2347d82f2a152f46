# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Package of the Blender extension.

Everything is imported when Blender registers it, never before: pytest and the worker also see this file, and neither
has Blender.
"""


def register():
    from . import wildcap_addon

    wildcap_addon.register()


def unregister():
    from . import wildcap_addon

    wildcap_addon.unregister()

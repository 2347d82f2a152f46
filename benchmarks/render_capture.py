# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a solved capture with Cycles through the installed extension's own functions, in a process of its own.

    python -m benchmarks.render_capture CAPTURE LIGHT [LIGHT ...]
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def main() -> None:
    capture, *lights = sys.argv[1:]
    with tempfile.TemporaryDirectory() as extensions:
        # Blender finds the checkout as an installed extension, under the very name users get.
        repository = Path(extensions) / "user_default"
        repository.mkdir()
        (repository / "wildcap").symlink_to(ROOT, target_is_directory=True)
        os.environ["BLENDER_USER_EXTENSIONS"] = extensions
        import bpy  # noqa: F401, I001  (makes addon_utils importable)
        import addon_utils

        if addon_utils.enable("bl_ext.user_default.wildcap") is None:
            raise SystemExit("Blender could not enable the extension.")
        from bl_ext.user_default.wildcap.wildcap_addon.relight.headless import render_relit

        try:
            for path in render_relit(Path(capture), lights):
                print(path, flush=True)
        finally:
            addon_utils.disable("bl_ext.user_default.wildcap")  # a class left registered crashes the wheel at exit


if __name__ == "__main__":
    main()

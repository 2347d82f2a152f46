# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Render a solved capture with Cycles through the installed extension's own functions, in a process of its own.

    python -m research.benchmarks.pictures.render_capture CAPTURE [LIGHT ...] [--resolution PX] [--samples N]

Each light (default: all presets; the name of one of Blender's worlds means that) gives renders/LIGHT.png, shown without
a look, and the linear renders/LIGHT.exr. (With Blender itself: blender --command wildcap ...)
"""

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ...people.blender_module import without_numpy_1
from ..figures import ROOT, command_line

EXTENSION = "bl_ext.user_default.wildcap"
"""Checkout's name in Blender, the very one that users get."""


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("capture", type=Path)
    parser.add_argument("lights", nargs="*", metavar="LIGHT")
    parser.add_argument("--resolution", type=int, default=640)
    parser.add_argument("--samples", type=int, default=32)
    options = parser.parse_args()
    with extension():
        from bl_ext.user_default.wildcap.wildcap_addon.relight import headless

        for path in headless.render_relit(
            options.capture, options.lights or headless.ALL, options.resolution, options.samples
        ):
            print(path, flush=True)


@contextlib.contextmanager
def extension() -> Iterator[None]:
    """Enable the checkout in this process's Blender as EXTENSION."""
    with tempfile.TemporaryDirectory() as extensions:
        repository = Path(extensions) / "user_default"
        repository.mkdir()
        (repository / "wildcap").symlink_to(ROOT, target_is_directory=True)
        os.environ["BLENDER_USER_EXTENSIONS"] = extensions
        with without_numpy_1():
            import bpy  # noqa: F401  (makes addon_utils importable)
        import addon_utils

        if addon_utils.enable(EXTENSION, default_set=True) is None:
            raise SystemExit("Blender could not enable the extension.")
        try:
            yield
        finally:
            addon_utils.disable(EXTENSION)  # a class left registered crashes the wheel at exit


if __name__ == "__main__":
    main()

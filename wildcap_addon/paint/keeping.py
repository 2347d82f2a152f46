# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a painted mask gets to the capture: at once, or aside in a thread, so that compressing and writing never hold up
a stroke; Blender itself only reads the pixels, into an array that is kept, as a fresh one takes longer to come by than
the reading.

A mask in the capture that this session did not write (the one of before it, or one that another Blender or the command
line has put there since) goes to the history first.
"""

import threading
from pathlib import Path

import bpy
import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.files import storage_problem
from ...core.capture.messages import Problem
from . import mask_image


def store_painting(mask: np.ndarray, capture: Capture, mask_kind: str, stamp: tuple) -> tuple:
    """Writes the mask that is being painted if it differs from the capture's; what this session did not write goes to
    the history first.

    Parameters
    ----------
    mask : [H, W] in [0, 1], rows from the top
    capture : whose it is
    mask_kind : 'SHADOW' or 'PROTECT'
    stamp : size and time of the file that this session wrote last; () before the first

    Returns
    -------
    The new stamp.

    Raises
    ------
    Problem
        Where it cannot be written.
    """
    path = mask_image.file_of(capture, mask_kind)
    try:
        written = mask_image.store_mask(mask, capture, mask_kind, keep=_stamp(path) != tuple(stamp))
        return _stamp(path) if written else stamp
    except OSError as error:  # a file server that is away for a moment: the next look tries again
        raise storage_problem(error, path) from error


_pixels: np.ndarray | None = None  # of the last look; a session has one Saving at a time


class Saving(threading.Thread):
    """One `store_painting` of an image's mask aside. Its thread touches nothing of Blender's; `result` is for the main
    thread, once it has ended."""

    def __init__(self, image: bpy.types.Image, capture: Capture, mask_kind: str, stamp: tuple):
        global _pixels
        super().__init__(name="wildcap-mask", daemon=False)  # Blender waits for it when it closes
        _pixels = mask_image.pixels(image, _pixels)
        self._arguments = _pixels, capture, mask_kind, stamp
        self._stamp: tuple = stamp
        self._problem: Problem | None = None
        self.start()

    def run(self) -> None:
        pixels, *rest = self._arguments
        try:
            self._stamp = store_painting(mask_image.from_top(pixels), *rest)
        except Problem as error:
            self._problem = error

    def result(self) -> tuple:
        """Waits, and gives the stamp. Raises Problem as `store_painting` does."""
        self.join()
        if self._problem is not None:
            raise self._problem
        return self._stamp


def prepare(image: bpy.types.Image) -> None:
    """Comes by the array aside, when the painting begins."""
    shape = image.size[1], image.size[0], image.channels

    def work() -> None:
        global _pixels
        _pixels = np.full(shape, 1.0, np.float32)  # written to once: until then it has no memory

    threading.Thread(target=work, name="wildcap-mask-array", daemon=True).start()


def forget() -> None:
    """Gives the kept array back, when the painting is over."""
    global _pixels
    _pixels = None


def _stamp(path: Path) -> tuple:
    try:
        info = path.stat()
    except OSError:
        return ()
    return info.st_size, info.st_mtime_ns

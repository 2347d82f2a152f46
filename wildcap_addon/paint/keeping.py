# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Storage of a painting, at once or in a thread, so that compressing and writing never delay a stroke.

Blender's thread only copies the pixels, into an array that is reused, as allocating one takes longer than copying. A
file that this session did not write (an older one, or one from another program) goes to the history first.
"""

import threading
from pathlib import Path

import bpy
import numpy as np

from ...core.capture.files import storage_problem
from ...core.capture.messages import Problem
from .. import data_blocks

_pixels: np.ndarray | None = None  # the reused array; a session has one Saving at a time


def store_painting(pixels: np.ndarray, painting, stamp: tuple) -> tuple:
    """Store an image's pixels [H, W, C], rows from the bottom, if they differ from the capture's.

    `painting` is a MaskPainting or a LayerPainting; `stamp` is the size and time of the file that this session wrote
    last, () before the first; the new one is returned. Raises Problem if it cannot be written.
    """
    try:
        was_written = painting.store(pixels, keep=_stamp(painting.file) != tuple(stamp))
        return _stamp(painting.file) if was_written else stamp
    except OSError as error:  # a file server may be briefly unavailable: the next look tries again
        raise storage_problem(error, painting.file) from error


class Saving(threading.Thread):
    """Thread that stores an image once; it touches nothing of Blender's."""

    def __init__(self, image: bpy.types.Image, painting, stamp: tuple):
        global _pixels
        super().__init__(name="wildcap-painting", daemon=False)  # Blender waits for it when it closes
        _pixels = data_blocks.read_pixels(image, _pixels)
        self._arguments = _pixels, painting, stamp
        self._stamp: tuple = stamp
        self._problem: Problem | None = None
        self.start()

    def run(self) -> None:
        try:
            self._stamp = store_painting(*self._arguments)
        except Problem as error:
            self._problem = error

    def result(self) -> tuple:
        """Wait, and return the stamp. Raises the Problem of `store_painting`. For the main thread."""
        self.join()
        if self._problem is not None:
            raise self._problem
        return self._stamp


def prepare(image: bpy.types.Image) -> None:
    """Allocate the array in a thread when the painting begins."""
    shape = image.size[1], image.size[0], image.channels

    def work() -> None:
        global _pixels
        _pixels = np.full(shape, 1.0, np.float32)  # the memory is allocated only when it is written

    threading.Thread(target=work, name="wildcap-painting-array", daemon=True).start()


def forget() -> None:
    """Free the array when the painting is over."""
    global _pixels
    _pixels = None


def _stamp(path: Path) -> tuple:
    try:
        info = path.stat()
    except OSError:
        return ()
    return info.st_size, info.st_mtime_ns

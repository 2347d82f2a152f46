# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the solver refuses, told to the person: its exceptions as Problems, each with a way out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ...capture.messages import Problem
from ...solver.prior.prior import MissingMapError
from ...solver.sampler import DivergedError
from ...solver.start import NoSkinError
from .released import NOISE_FILE

REMEDIES: dict[type[Exception], str] = {
    NoSkinError: "Look at the texture in the report; film the face from the front and from both sides.",
    MissingMapError: f"Save the map it was trained with beside ckpt.pth as {NOISE_FILE}, float32 of shape 3, S, S.",
    DivergedError: "Check that the texture and the mask are those of this head, or choose the proximal guidance.",
}
"""What to do about an exception, whose own words say what is wrong."""


@contextmanager
def tell_refusals() -> Iterator[None]:
    """Around what calls the solver, as a context or as a decorator."""
    try:
        yield
    except tuple(REMEDIES) as error:
        raise Problem(str(error), REMEDIES[type(error)]) from error

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Turn the solver's exceptions into Problems, each with a remedy."""

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


@contextmanager
def tell_refusals() -> Iterator[None]:
    """Convert exceptions of what calls the solver, as a context or as a decorator."""
    try:
        yield
    except tuple(REMEDIES) as error:
        raise Problem(str(error), REMEDIES[type(error)]) from error

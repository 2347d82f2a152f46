# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/controlled.md: the gap to a controlled capture, and studio input."""

import numpy as np

from ..figures import Figures
from ..light import torch as torch_rooms
from ..light.controlled import table
from ..pages import prose
from .comparison import by_person

TITLE = "The gap to a controlled capture, and studio input"
SAYS = "The same people under a flash in a dark room, and in front of sixteen fixed cameras in even light."
RECORDS = ("controlled", "torch")


def sections(controlled: Figures, torch: Figures) -> str:
    mean, people = controlled.mean, controlled.people
    adds = {name: rows.studio.psnr_after_gain - rows.studio_texture.psnr_after_gain for name, rows in people.items()}
    added = list(adds.values())
    return prose(
        """
        The six people of the [gallery](gallery.md), in a dark room with a lamp at the camera (the paper's comparison
        with DoRA), and in front of sixteen fixed cameras in even light. The lamp's light is known and divided out of
        the frames. These figures are of the fit before *Torch*: one in which the room was dark and the highlight had a
        strength of its own at every place. The solve then holds an even light. *True frames* is the true
        albedo as a texture: its loss is that of geometry and texture. All maps are scored in the frames of the capture
        in the wild. Moles: 1 is all of their contrast. In the studio no delighter runs and the mask is empty.
        """,
        table(controlled),
        f"""
        The gap to a flash in a dark room is {mean.flash.psnr_after_gain - mean.wild.psnr_after_gain:.1f} dB (the paper
        reports comparable quality, without figures). The captures in the wild lose low-frequency light that no stage
        separated from skin, and moles: the delighter's frames keep {mean.wild_texture.mole_contrast:.2f} of their
        contrast, the flash's {mean.flash_texture.mole_contrast:.2f}. Light that bounces between lids, nose and lips is
        not part of the known light and stays in the flash's maps.

        **In the studio the solve adds {np.mean(added):+.2f} ± {np.std(added, ddof=1) / len(added) ** 0.5:.2f} dB after
        one gain** ({by_person(adds)}), {mean.studio.psnr - mean.studio_texture.psnr:+.2f} dB without it: such frames
        need no solve. The rows *in the wild, solved* are the maps of [the state of the albedo](state.md), by the same
        solver.
        """,
        f"""
        ## The torch in a room that is not dark

        Light adds up: frames of the dark room and of the person's own light, from the same {len(torch.people)} people's
        cameras, make a room of any brightness. A share is the room's light over the torch's, mean over the face. Each
        frame goes through a phone's pipeline (metering of its own, tone curve, local contrast, sharpening) before
        *Torch* sees it. The last row has the room's light alone, and the default delighter. All maps are
        textures, not solved, scored in the frames; ± is the deviation over the people. The phone sharpens, so that
        moles may have more than their contrast.
        """,
        torch_rooms.table(torch.people),
        f"""
        Against the wild frames of the same cameras the torch gains, in dB: in the dark
        {by_person(torch_rooms.gains(torch.people, "torch"))}; where the room has three tenths of its light
        {by_person(torch_rooms.gains(torch.people, "torch, room 30 %"))}; where both are equal
        {by_person(torch_rooms.gains(torch.people, "torch, room 100 %"))}.
        """,
    )

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/relit.md: the number that artists feel, the head under another light."""

from ..figures import Figures
from ..light.relit import table
from ..pages import Sections, prose
from .sample import TITLE as SAMPLE

TITLE = "Relit"
SAYS = "The solved head and the true subject under six lights of which none lit a capture."
RECORDS = ("relit", "relit_people")


def sections(relit: Figures, people: Figures) -> Sections:
    sample, mean = relit.sample, people.mean
    return [
        (
            "",
            prose("""
        The presets *three-point*, *window*, *sun* and *coloured*, Blender's worlds *city* and *interior*. Both heads
        wear the add-on's material on the same registered head, so what differs is the maps; it wears the true ones
        where its surface lies on the true head. (Where UVs agree is a millimetre beside that, by which all fine detail
        would count as an error.) Cycles (320 px, 16 rays, denoised, the rectangle about the face) to linear EXR;
        exposed so that the true subject's face has a mean luminance of 0.18, one gain per light for all rows; then the
        sRGB curve, clipped. No AgX.

        A cell is PSNR, SSIM and FLIP over the face, mean of the six lights. Every albedo has the true tone as its mean
        over confident facial skin, by one gain per channel; every row wears the solved relief and gloss where it does
        not say otherwise. Maps are averaged to 1024, where a texel is finer than a
        pixel: nothing of this says what 4K adds.
        """),
        ),
        (
            SAMPLE,
            prose(
                table(relit),
                f"""
        Solved is {sample.solved.psnr - sample.raw.psnr:.1f} dB over the filmed texture (asked for: 1 dB) and
        {sample.solved.psnr - sample.delit.psnr:.2f} dB over the delit one (0.5 dB). The albedo costs nearly all that is
        missing: with the true one {sample.true_albedo.psnr:.0f} dB are reached. **Relief and gloss hardly matter**:
        against none the relief, which is what is expected of the albedo, gains
        {sample.solved.psnr - sample.no_relief.psnr:+.2f} dB, and against an even gloss the mean face's gains
        {sample.solved.psnr - sample.even_gloss.psnr:+.2f} dB (asked for together: 0.3 dB); the true ones would bring
        {sample.true_normal.psnr - sample.solved.psnr:.2f} and {sample.true_specular.psnr - sample.solved.psnr:.2f} dB.
        A rendering's own noise is no limit: two renderings of the
        truth with different random numbers differ by {sample.floor.psnr:.0f} dB, and all other rows share the truth's.

        ![Truth, solved, delit texture, raw texture under six new lights](../pictures/relit.jpg)

        *Three-point, window and sun (left), coloured, city and interior (right); from left to right the true subject,
        the solved maps, the delit and the filmed texture as albedo (sRGB curve; Blender's view transform Standard).*
        """,
            ),
        ),
        (
            "Six people",
            prose(
                """
        Those of the [gallery](gallery.md), solved at standard quality from forty frames, maps of 1024.
        """,
                table(people),
                f"""
        On their mean the solve gains {mean.solved.psnr - mean.raw.psnr:.1f} dB over the filmed texture and
        {mean.solved.psnr - mean.delit.psnr:.2f} dB over the delit one, and relief and gloss
        {mean.solved.psnr - mean.plain.psnr:+.2f} dB over none and an even one: {by_person(people)}.
        """,
            ),
        ),
    ]


def by_person(people: Figures) -> str:
    """Return what relief and gloss are worth to each: 'dark +1.30'."""
    return ", ".join(
        f"{name.replace('_', ' ')} {rows.solved.psnr - rows.plain.psnr:+.2f}"
        for name, rows in people.items()
        if name != "mean"
    )

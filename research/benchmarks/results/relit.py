# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/relit.md: the head under another light."""

from ..figures import Figures
from ..light.relit import table
from ..pages import Sections, prose
from .sample import TITLE as SAMPLE

TITLE = "Relit"
SAYS = "The solved head and the true subject under six lights, none of which lit a capture."
RECORDS = ("relit", "relit_people")


def sections(relit: Figures, people: Figures) -> Sections:
    sample, mean = relit.sample, people.mean
    solved = sample.solved.psnr
    setup = """
        The presets *three-point*, *window*, *sun* and *coloured*, and Blender's worlds *city* and *interior*. Both
        heads wear the add-on's material on the same registered head, so only the maps differ. It wears the true maps
        where its surface lies on the true head; where the UVs agree is a millimetre off, by which all fine detail would
        count as an error. Cycles (320 px, 16 rays, denoised, the rectangle about the face) renders linear EXR. The
        exposure gives the true subject's face a mean luminance of 0.18, one gain per light for all rows; then comes the
        sRGB curve, clipped, without AgX.

        A cell is PSNR, SSIM and FLIP over the face, mean of the six lights. Every albedo has the true tone as its mean
        over confident facial skin, by one gain per channel; every row wears the solved relief and gloss unless it says
        otherwise. Maps are averaged to 1024, where a texel is finer than a pixel: the gain of 4K is not measured.
        """
    reading = f"""
        The solved head is {solved - sample.raw.psnr:.1f} dB over the filmed texture (goal: 1 dB) and
        {solved - sample.delit.psnr:.2f} dB over the delit one (0.5 dB). Nearly all of the rest is the albedo's error:
        the true one reaches {sample.true_albedo.psnr:.0f} dB. **Relief and gloss hardly matter**: the relief, expected
        from the albedo, gains {solved - sample.no_relief.psnr:+.2f} dB over none, and the mean face's gloss
        {solved - sample.even_gloss.psnr:+.2f} dB over an even one (goal together: 0.3 dB); the true ones would add
        {sample.true_normal.psnr - solved:.2f} and {sample.true_specular.psnr - solved:.2f} dB. The rendering's noise is
        no limit: two renderings of the truth with different random numbers differ by {sample.floor.psnr:.0f} dB, and
        all other rows share the truth's.

        ![Truth, solved, delit texture, raw texture under six new lights](../pictures/relit.jpg)

        *Three-point, window and sun (left), coloured, city and interior (right); from left to right the true subject,
        the solved maps, the delit and the filmed texture as albedo (sRGB curve; Blender's view transform Standard).*
        """
    on_people = f"""
        On their mean the solve gains {mean.solved.psnr - mean.raw.psnr:.1f} dB over the filmed texture and
        {mean.solved.psnr - mean.delit.psnr:.2f} dB over the delit one, and relief and gloss
        {mean.solved.psnr - mean.plain.psnr:+.2f} dB over none and an even one: {by_person(people)}.
        """
    gallery = "The people of the [gallery](gallery.md), solved at standard quality from forty frames, maps of 1024."
    return [
        ("", prose(setup)),
        (SAMPLE, prose(table(relit), reading)),
        ("Six people", prose(gallery, table(people), on_people)),
    ]


def by_person(people: Figures) -> str:
    """Return the gain of relief and gloss by person."""
    gains = {name: rows.solved.psnr - rows.plain.psnr for name, rows in people.items() if name != "mean"}
    return ", ".join(f"{name.replace('_', ' ')} {gain:+.2f}" for name, gain in gains.items())

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/comparison.md: albedo against the truth, beside other light models."""

from __future__ import annotations

from ..comparison_table import table
from ..figures import Figures
from ..pages import Sections, prose
from .split import OLDER

TITLE = "Albedo against the truth, beside other light models"
SAYS = "Regions, one environment, no prior, or a blur divided out, instead of the paper's grid of lights."
RECORDS = ("comparison",)


def sections(comparison: Figures) -> Sections:
    raw, delit, scan = comparison.people.raw, comparison.people.delit, comparison.scan
    one = {name: {kind: subject[kind] for kind in ("raw", "delit")} for name, subject in comparison.subjects.items()}

    def single(name: str, kind: str, row: str) -> float:
        return one[name][kind][row]["0"].raw.psnr

    ahead = {name: single(name, "delit", "environment") - single(name, "delit", "wildcap")
             for name in one if name != "scan"}
    rival = max((row for row in scan.raw if row != "wildcap"), key=lambda row: scan.raw[row].PSNR)

    return [("", prose(f"""
        The baselines are of our own writing (`benchmarks/light_models.py`), not those authors' code, and put other
        light models behind our solver: the same prior, guidance, start and pulls. *Regions*: five or ten soft regions
        with an SH light each; where they lie is learned, as in DeFace, and begins as clusters of place and lightness,
        so they are a shadow mask of sorts. *Environment*: one diffuse cubemap for the whole face, as in FLARE. *No
        prior*: its albedo's texels follow the frames alone, smoothly. *Over its blur*: the texture divided by its own
        blur, what one does by hand. All maps have {comparison.size} texels a side; the mean is over the six people of
        the [gallery](gallery.md); a row's best and its ties (within half of what two seeds of ours differ by) are bold,
        for each input apart. SSIM and FLIP are those after one gain.
        """, OLDER, table(comparison))),
        ("Read honestly", prose(f"""
        **We do not lead everywhere.** What the paper's light model is for, light that is still in the frames, it does:
        on raw frames it is {raw.wildcap.PSNR - raw.texture.PSNR:.1f} dB over the texture and
        {raw.wildcap.PSNR - raw.environment.PSNR:.1f} dB over one environment; regions that learn where the shadows lie
        are as good (five {raw["regions 5"].PSNR - raw.wildcap.PSNR:+.2f} dB in PSNR, ten
        {raw["regions 10"].PSNR - raw.wildcap.PSNR:+.2f} dB, FLIP {raw["regions 5"].FLIP:.3f} and
        {raw["regions 10"].FLIP:.3f} to our {raw.wildcap.FLIP:.3f}), and leave less of a shadow's edge. On the one real
        skin, the head scan, it leads by {scan.raw.wildcap.PSNR - scan.raw[rival].PSNR:.1f} dB on raw frames, and
        is the best light model on delit ones, {scan.delit.wildcap.PSNR - scan.delit["regions 10"].PSNR:.1f} dB over
        regions and {scan.delit.wildcap.PSNR - scan.delit.environment.PSNR:.1f} dB over the environment; the texture
        taken as it is beats it there by {scan.delit.texture.PSNR - scan.delit.wildcap.PSNR:.1f} dB.

        **On delit synthetic people freer lights are ahead**: regions by
        {delit["regions 10"].PSNR - delit.wildcap.PSNR:.1f} dB, the environment by
        {delit.environment.PSNR - delit.wildcap.PSNR:.1f} dB ({by_person(ahead)}). Where the delighter left most of the
        light (tan, three mixed lamps: {single("tan", "delit", "texture"):.1f} dB as a texture) the environment gains
        {single("tan", "delit", "environment") - single("tan", "delit", "texture"):.1f} dB, ours
        {single("tan", "delit", "wildcap") - single("tan", "delit", "texture"):.1f} dB. After a delighter our lights
        were held back, because on the scan a free light takes the beard and the cheeks for light; on these people a
        free light is right: they come from the generator that made the prior's mean face and have few large traits of
        their own. The regions'
        shared light was held as ours was, their own lights towards none; the environment is held by its smoothness.

        **On raw frames of dark skin** (dark: {single("dark", "raw", "wildcap"):.1f} dB, regions
        {single("dark", "raw", "regions 5"):.1f} dB) highlights stay in our albedo: local light may only darken, and
        only inside the mask.

        **What would change it**: a prior that has seen many real people, beards among them; local light that may
        brighten; and more heads to choose on than these eight. The first needs data that may be trained on and a GPU.
        """))]


def by_person(gains: dict[str, float]) -> str:
    """dB by person, the most first."""
    return ", ".join(f"{name.replace('_', ' ')} {gain:+.1f}"
                     for name, gain in sorted(gains.items(), key=lambda item: -item[1]))

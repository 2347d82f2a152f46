# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/comparison.md: albedo against the truth, beside other light models."""

from ..figures import Figures
from ..maps.comparison_table import paired, paired_table, table
from ..pages import Sections, prose

TITLE = "Albedo against the truth, beside other light models"
SAYS = "Regions, one environment, no prior, or a blur divided out, instead of the paper's grid of lights."
RECORDS = ("comparison",)
FREE = "environment, no prior"


def sections(comparison: Figures) -> Sections:
    raw, scan = comparison.people.raw, comparison.scan
    people = {name: subject for name, subject in comparison.subjects.items() if name != "scan"}
    rival = max((row for row in scan.raw if row != "wildcap"), key=lambda row: scan.raw[row].PSNR)

    def ours_less(kind: str, row: str) -> str:
        """Return ours less another method's PSNR over the people."""
        return "{:+.2f} ± {:.2f} dB".format(*paired(people)[kind][row]["PSNR, dB"])

    def each(kind: str, row: str) -> str:
        """Return the same, person by person."""
        both = {name: (subject[kind].wildcap["0"], subject[kind][row]["0"]) for name, subject in people.items()}
        return by_person({name: ours.raw.psnr - other.raw.psnr for name, (ours, other) in both.items()})

    setup = f"""
        The baselines are our own implementations (`research/benchmarks/maps/light_models.py`), not the authors' code.
        They put other light models behind our solver, with the same prior, guidance and start. *Regions*: five or ten
        soft regions with an SH light each; their places are learned, as in DeFace, and begin as clusters of place and
        lightness, so they act as a kind of shadow mask. *Environment*: one diffuse cubemap for the whole face, as in
        FLARE. *No prior*: the albedo's texels follow the frames alone, smoothly. *Over its blur*: the texture divided
        by its own blur, the manual method. All maps have {comparison.size} texels a side. Means are over the six people
        of the [gallery](gallery.md); for each input, the best row and its ties (within half of the difference between
        two of our seeds) are bold. SSIM and FLIP are after one gain. The head scan is filmed under the sun behind
        leaves (`python -m research.benchmarks.captures.scan_captures DATA FOLDER --lights leaves`); its own map, which
        stands for the truth, contains light.
        """
    return [
        ("", prose(setup, table(comparison))),
        (
            "Person by person",
            prose(
                """
        Ours less each other method, mean over the six people ± its standard error: bold if ours is better by more than
        two standard errors, italic if it is worse by more than one.
        """,
                paired_table(people),
            ),
        ),
        (
            "How we read it",
            prose(f"""
        **On raw frames**, the case that the paper's light model is made for, ours is {ours_less("raw", "texture")} over
        the texture, {ours_less("raw", "environment")} over one environment ({each("raw", "environment")}) and
        {ours_less("raw", "regions 10")} over ten regions that learn the places of the shadows
        ({each("raw", "regions 10")}). Ten regions leave {raw["regions 10"]["shadow step"]:.2f} of a shadow's edge, ours
        {raw.wildcap["shadow step"]:.2f}. On the head scan ours has {scan.raw.wildcap.PSNR:.1f} dB; the best of the
        others, *{rival}*, has {scan.raw[rival].PSNR:.1f} dB.

        **On delit frames** ours is {ours_less("delit", "texture")} over the texture ({each("delit", "texture")}),
        {ours_less("delit", "regions 10")} over ten regions and {ours_less("delit", "environment")} over one environment
        ({each("delit", "environment")}), which is held by its smoothness alone. On the head scan the texture has
        {scan.delit.texture.PSNR:.1f} dB, ours {scan.delit.wildcap.PSNR:.1f} dB and the environment
        {scan.delit.environment.PSNR:.1f} dB.

        **Without the prior**, with one environment and free texels, the result is behind ours by
        {ours_less("raw", FREE)} on raw frames and by {ours_less("delit", FREE)} on delit ones, where little light is
        left to separate from skin.
        """),
        ),
    ]


def by_person(gains: dict[str, float]) -> str:
    """Return the gains in dB by person, the most first."""
    ordered = sorted(gains.items(), key=lambda item: -item[1])
    return ", ".join(f"{name.replace('_', ' ')} {gain:+.1f}" for name, gain in ordered)

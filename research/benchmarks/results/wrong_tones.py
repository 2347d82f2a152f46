# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/wrong_tones.md: a solve at a skin tone that is wrong."""

from ..figures import Figures, markdown, number
from ..maps.wrong_tones import STEPS, TOLD, UPDATES, WORKING
from ..pages import Sections, prose

TITLE = "A wrong skin tone"
SAYS = "The albedo, brows, lips, beards, moles and irises where the skin tone is up to 25 L* off, by group of tone."
RECORDS = ("wrong_tones",)
FEATURES = ("brows", "lips", "beard", "moles")
CELLS = ((TOLD, "+0"), (TOLD, "-25"), (TOLD, "+25"), (WORKING, "+0"), (WORKING, "-25"))


def sections(record: Figures) -> Sections:
    subjects, captures, irises = record.subjects, record.captures, record.irises
    head = ["told, right", "told, 25 too dark", "told, 25 too light", "working, right", "working, 25 too dark"]
    albedos = [
        [row.group, f"{row.lightness:.0f}", f"{row.texture.psnr:.2f}", *(psnr(row, *cell) for cell in CELLS)]
        for row in by_lightness(subjects)
    ]
    gains = [row[WORKING]["+0"].psnr - row[TOLD]["+0"].psnr for row in subjects.values()]
    moved = [abs(row[WORKING]["-25"].psnr - row[WORKING]["+0"].psnr) for row in subjects.values()]
    setup = f"""
        Synthetic subjects that no training saw, with textures as a delighter leaves them
        (`research/benchmarks/maps/uv_problems.py`, kind delit), in drafts of {STEPS} steps with {UPDATES} updates of
        the light at 256 x 256 texels. *Told*: sampled in the tone that is given, as the solver did before. *Working*:
        sampled in the [working tone](../method/prior_and_guidance.md#the-prior), the given one put on the albedo at the
        end. A tone is *right*, or off by so much L* at the same ratios of its channels.

        At the right tone the working tone changes a subject's PSNR by {min(gains):+.2f} to {max(gains):+.2f} dB; a tone
        25 L* too dark changes it by at most {max(moved):.3f} dB more. That solve(g texture, g tone) is g solve(texture,
        tone) to 1 % is a test (`tests/core/stages/solve/test_working_tone.py`).
        """
    return [
        ("", prose(setup)),
        (
            "The albedo",
            prose(
                "PSNR in dB (sRGB) on the face, after one gain.",
                markdown(["group", "L*", "delit texture", *head], albedos),
            ),
        ),
        (
            "What is kept",
            prose(FEATURE_WORDS, markdown(["group", "L*", "feature", "truth", *head], features(subjects))),
        ),
        ("Real captures", prose(CAPTURE_WORDS, markdown(CAPTURE_HEAD, real(captures)))),
        ("Irises", prose(IRIS_WORDS, markdown(["iris", "mean", "most"], colours(irises)), f"{irises.people} people.")),
    ]


FEATURE_WORDS = """
    Share of the delit texture's contrast: the slope of the albedo's ln luminance on the texture's, in and about a
    feature. Of the light in the texture nothing should be kept: the true albedo has the share in the column *truth*.
    Lips and brows are in every face; beards and moles where the subject has them.
    """
CAPTURE_WORDS = """
    Single photographs of real people (of near_ps_human1 the mean of seven, each under another lamp), solved as the
    subjects above: two with a beard, one brown, one fair. The right tone is the estimate; *least* is the least share
    of the delit texture's contrast over tones that are off by -25, -12, 0, 12 and 25 L*, *moved* the largest change of
    such a share between them. *Apart*: deviation of ln albedo on the skin from the right tone's, after one gain, at the
    worst of these tones; what moves, moves where fair skin made lighter is clipped at an albedo of 1. Of *told* the
    right tone and the one 25 L* too dark were solved.
    """
CAPTURE_HEAD = ["capture", "L*", "feature", "told, right", "told, 25 too dark", "working, least", "working, moved"]
IRIS_WORDS = """
    Delta E 2000 of the irises of those people of london_faces whom the fit left out, one camera and one light giving
    their truth: by the white and the skin beside them, by skin alone, and as before, by skin of a tone that is given.
    The skin tone's page has [how far off](skin_tone.md) a tone is that frames alone tell.
    """


def by_lightness(cases: Figures) -> list[Figures]:
    return sorted(cases.values(), key=lambda row: -row.lightness)


def psnr(row: Figures, way: str, off: str) -> str | None:
    return number(row[way][off].psnr if off in row[way] else None, 2)


def features(subjects: Figures) -> list[list]:
    return [
        [
            row.group,
            f"{row.lightness:.0f}",
            name,
            f"{row.truth[name]:.2f}",
            *(number(row[way].get(off, {}).get(name), 2) for way, off in CELLS),
        ]
        for row in by_lightness(subjects)
        for name in FEATURES
        if name in row.texture
    ]


def real(captures: Figures) -> list[list]:
    """Return a row of each feature, and one of the albedo, of each capture."""
    rows = []
    for name, row in captures.items():
        told, working = row[TOLD], row[WORKING].values()
        for feature in [feature for feature in FEATURES if feature in told["+0"]]:
            shares = [each[feature] for each in working]
            before = [f"{told[off][feature]:.2f}" for off in ("+0", "-25")]
            rows.append(
                [
                    name,
                    f"{row.lightness:.0f}",
                    feature,
                    *before,
                    f"{min(shares):.2f}",
                    f"{max(shares) - min(shares):.3f}",
                ]
            )
        apart = f"{told['-25'].apart:.3f}", None, f"{max(each.apart for each in working):.4f}"
        rows.append([name, f"{row.lightness:.0f}", "apart", None, *apart])
    return rows


def colours(irises: Figures) -> list[list]:
    return [[way, f"{row.mean:.1f}", f"{row.most:.1f}"] for way, row in irises.items() if way != "people"]

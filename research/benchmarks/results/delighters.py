# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/delighters.md: what takes the light out of the frames, against the true albedo."""

from statistics import mean, stdev

from ..captures import likenesses, scan_captures
from ..captures.state_captures import DELIT, SOLVED
from ..delighting import state
from ..delighting.delight_measures import shortfalls, table
from ..delighting.state_scores import mean_of
from ..figures import Figures
from ..measures.table import Scores, format_table, summarise
from ..pages import Sections, prose

TITLE = "Delighters"
SAYS = "The network, shading and others on real photographs, portraits of six tones, the scan and the sample."
RECORDS = ("delight", "state", "state_sky")  # the last one is cut down to the rows that this page shows
PEOPLE = ("bearded_overcast", "closed_overcast", "dark_overcast", "fringed_overcast", "stubbled_below", "light_below")
SURVIVING = {
    name: state.TABLES[title][name]
    for title, names in (
        ("In the picture", ("psnr", "ssim", "flip", "detail")),
        ("Up to a light, and across lights", ("psnr_uv", "psnr_alone")),
    )
    for name in names
}


def sections(delight: Figures, before: Figures, now: Figures) -> Sections:
    real, portraits, scan, sample = delight.faceolat, delight.portraits, delight.lps_sun, delight.sample
    alone = "network, one photograph"
    photograph, untouched, flat = real[alone].figures, real.none.figures, real["flat true tone"].figures
    gains, alone_gains = (
        [delight[name][row].figures.psnr - delight[name][f"{row}, before"].figures.psnr for name in PEOPLE]
        for row in ("network", "shading")
    )
    sample_gain, scan_gain, *scans = (
        found.network.figures.psnr - found["network, before"].figures.psnr
        for found in (sample, scan, delight.scan_overcast, delight.scan_lamps)
    )
    lost = shortfalls(
        {
            name: {row: rows[row] for row in ("none", "shading", "network") if row in rows}
            for name, rows in delight.items()
        }
    )  # of groups as well, which have a second colon
    left = [portraits[row].groups.light.figures.shadow_step for row in (alone, "none")]
    return [
        (
            "",
            prose(
                """
        Delit pictures against the true albedo, over the facial skin, after one gain per channel in linear light; means
        over the pictures. *features* is the distance in EfficientNet-Lite0's features (it is not LPIPS), *detail* the
        correlation with the truth's detail between 1 and 3 px, *shadow step* what is left of the light's step along the
        true shadow's edge where it exceeds 0.2 in natural log. *none* is the picture as it was shot, *flat true tone*
        the true mean skin colour everywhere.

        - *faceolat*: photographs of two real people on a light stage, twelve lights each; what counts as their albedo
          is itself a photograph in even light. True shadows are not known.
        - *portraits*: 36 synthetic subjects that no training sees, six per group of skin tone (individual typology
          angle), two lights each, without geometry.
        - *lps_sun*: 14 frames of the head scan's capture, *sample*: 14 of the synthetic sample's, both with cameras and
          head.
        - *bearded_overcast* to *light_below*: 14 frames each of six people in soft light or under a lamp from below
          (`python -m research.benchmarks.captures.likenesses FOLDER`), *scan_overcast* and *scan_lamps* of the head
          scan (`python -m research.benchmarks.captures.scan_captures`), with true cameras.

        Captures are named by `--sets TRUTH --capture TRUTH=CAPTURE`. The rows *before* are by the same command at
        commit 3cc06ee0, before the fitted light expected a sky ([delighting](../method/delighting.md)) and hues in the
        dark were settled, which these sets hardly show. *features* was not measured anew.
        """,
                table(delight),
                f"""
        **What the sky is worth**: to the frames that the network leaves of the six people
        {mean(gains):+.2f} ± {stdev(gains) / len(gains) ** 0.5:.2f} dB (each: {listed(gains)}), to those of *shading*
        {mean(alone_gains):+.2f} ± {stdev(alone_gains) / len(alone_gains) ** 0.5:.2f} dB ({listed(alone_gains)}).
        Before, the prior held every sky nearly even. The sample: {sample_gain:+.2f} dB; the scan: {listed(scans)} dB in
        overcast light and under two lamps, and {scan_gain:+.2f} dB in the sun behind leaves: its own map holds light,
        which may pass for a sky.

        Two of the 36 subjects were sorted without their skin's saturation, and count in the group beside theirs. On the
        real photographs the network gains {photograph.psnr - untouched.psnr:.1f} dB over the picture as it is and
        {photograph.psnr - flat.psnr:.1f} dB over the flat true tone; **in SSIM the flat tone stays ahead there**
        ({photograph.ssim:.3f} against {flat.ssim:.3f}), and on the synthetic portraits in PSNR as well: our subjects'
        skin is nearly flat at their size. Of the shadow's step in the group *light* {left[0]:.2f} of {left[1]:.2f} is
        left. Where the network in captures is no better than the picture as it is or *shading*, detail apart:
        {"; ".join(found for found in lost if found.count(":") == 1) or "nowhere"}. Without the geometry of a capture
        (*one photograph*) it loses {scan.network.figures.psnr - scan[alone].figures.psnr:.1f} dB on the scan and
        {sample.network.figures.psnr - sample[alone].figures.psnr:.1f} dB on the sample: what is beard and what is
        shade, one picture does not tell.

        ![Synthetic people of six tones, their albedo, and three answers](../pictures/delighters.jpg)

        *One portrait per group of skin tone: the picture, its true albedo, the picture as it is after a gain per
        channel, the flat true tone, the network on one photograph (`--sets portraits --quick --picture
        docs/pictures/delighters.jpg`).*

        `--quick` takes every fourth picture and leaves the feature distance out; `--weights FILE` measures other
        weights of our network, `--opendelight FOLDER` the authors' checkpoint.
        """,
            ),
        ),
        ("After the solve", after_the_solve(before, now)),
    ]


def after_the_solve(before: Figures, now: Figures) -> str:
    """Return what the sky is worth to textures and solved albedos, person by person on the captures of both records."""
    rows = paired(before, now)
    shared = [name for name in now.captures if name in before.captures]
    gains = [now.captures[name][SOLVED].psnr - before.captures[name][SOLVED].psnr for name in shared]
    most, least = (shared[gains.index(gain)] for gain in (max(gains), min(gains)))
    return (
        prose(f"""
        How much of the sky's worth the solve would have found by itself: {len(shared)} captures of [the
        state of the albedo](state.md), rendered anew and taken through a delighter that expects a sky (with `--run`
        first), beside that page's own figures, *before*. Means over {len(rows[SOLVED])} people, each the mean of its
        captures. Of the solved albedos {sum(gain > 0 for gain in gains)} of {len(gains)} came nearer to the truth in
        the picture, from {min(gains):+.2f} dB (`{least}`) to {max(gains):+.2f} dB (`{most}`). The solver is the same
        but for how far skins' traits differ from place to place ([the prior](prior.md)); hues in the dark were not
        settled yet.
        """)
        + "\n\n"
        + "\n\n".join(
            format_table(
                summarise({row: rows[row] for row in (f"{method}, before", method)}, SURVIVING, f"{method}, before"),
                SURVIVING,
                "taken for albedo",
                f"{method}, before",
            )
            for method in (DELIT, SOLVED)
        )
    )


def paired(before: Figures, now: Figures) -> Scores:
    """Texture and solved albedo of both records -> person -> figures: means over the captures that both hold."""
    shared = [name for name in now.captures if name in before.captures]
    people = {person: [name for name in shared if person_of(name) == person] for person in map(person_of, shared)}
    return {
        title: {person: mean_of([record.captures[name][method] for name in own]) for person, own in people.items()}
        for method in (DELIT, SOLVED)
        for title, record in ((f"{method}, before", before), (method, now))
    }


def person_of(capture: str) -> str:
    """Return a capture's name without its light."""
    for light in (*likenesses.LIGHTS, *scan_captures.LIGHTS):
        capture = capture.removesuffix(f"_{light}")
    return capture


def listed(gains: list[float]) -> str:
    return ", ".join(f"{gain:+.2f}" for gain in gains)

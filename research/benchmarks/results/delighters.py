# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/delighters.md: the delighters against the true albedo."""

from statistics import mean, stdev

from ..captures import likenesses, scan_captures
from ..captures.state_captures import DELIT, SOLVED
from ..delighting import state
from ..delighting.delight_measures import shortfalls, table
from ..figures import Figures
from ..measures.table import Scores, format_table, mean_of, summarise
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

    def gain(name: str, row: str = "network") -> float:
        return delight[name][row].figures.psnr - delight[name][f"{row}, before"].figures.psnr

    gains, alone_gains = ([gain(name, row) for name in PEOPLE] for row in ("network", "shading"))
    shown = {
        name: {row: rows[row] for row in ("none", "shading", "network") if row in rows}
        for name, rows in delight.items()
    }
    # lines of groups have a second colon
    lost = [line for line in shortfalls(shown) if line.count(":") == 1]
    left = [portraits[row].groups.light.figures.shadow_step for row in (alone, "none")]
    setup = """
        Delit pictures against the true albedo, over the facial skin, after one gain per channel in linear light; means
        over the pictures. *features* is the distance in EfficientNet-Lite0's features (not LPIPS), *detail* the
        correlation with the truth's detail between 1 and 3 px, *shadow step* the remaining part of the light's step
        along the true shadow's edge, where it exceeds 0.2 in natural log. *none* is the untouched picture, *flat true
        tone* the true mean skin colour everywhere.

        - *faceolat*: photographs of two real people on a light stage, twelve lights each; their albedo is itself a
          photograph in even light, and true shadows are not known.
        - *portraits*: 36 synthetic subjects that no training sees, six per group of skin tone (individual typology
          angle), two lights each, without geometry.
        - *lps_sun*: 14 frames of the head scan's capture, *sample*: 14 of the synthetic sample's, both with cameras and
          head.
        - *bearded_overcast* to *light_below*: 14 frames each of six people in soft light or under a lamp from below
          (`python -m research.benchmarks.captures.likenesses FOLDER`), *scan_overcast* and *scan_lamps* of the head
          scan (`python -m research.benchmarks.captures.scan_captures`), with true cameras.

        `--sets TRUTH --capture TRUTH=CAPTURE` names captures. The rows *before* are by the same command at commit
        3cc06ee0, before the fitted light expected a sky ([delighting](../method/delighting.md)) and hues in the dark
        were settled, which these sets hardly show. *features* was not measured anew.
        """
    reading = f"""
        **The worth of the sky**: {with_error(gains)} dB for the six people's frames by the network (each:
        {listed(gains)}), {with_error(alone_gains)} dB by *shading* ({listed(alone_gains)}). Before, the prior held
        every sky nearly even. The sample: {gain("sample"):+.2f} dB. The scan:
        {listed([gain("scan_overcast"), gain("scan_lamps")])} dB in overcast light and under two lamps, and
        {gain("lps_sun"):+.2f} dB in the sun behind leaves: its own map contains light, which may pass for a sky.

        Two of the 36 subjects were sorted without their skin's saturation, and count in the neighbouring group. On the
        real photographs the network gains {photograph.psnr - untouched.psnr:.1f} dB over the untouched picture and
        {photograph.psnr - flat.psnr:.1f} dB over the flat true tone; **in SSIM the flat tone stays ahead there**
        ({photograph.ssim:.3f} against {flat.ssim:.3f}), and on the synthetic portraits in PSNR as well: our subjects'
        skin is nearly flat at their size. In the group *light* {left[0]:.2f} of {left[1]:.2f} of the shadow's step is
        left. In captures the network is no better than the untouched picture or *shading*, detail apart, in:
        {"; ".join(lost) or "nothing"}. Without the geometry of a capture (*one photograph*) it loses
        {scan.network.figures.psnr - scan[alone].figures.psnr:.1f} dB on the scan and
        {sample.network.figures.psnr - sample[alone].figures.psnr:.1f} dB on the sample: one picture does not tell beard
        from shade.

        ![Synthetic people of six tones, their albedo, and three answers](../pictures/delighters.jpg)

        *One portrait per group of skin tone: the picture, its true albedo, the untouched picture after a gain per
        channel, the flat true tone, the network on one photograph (`--sets portraits --quick --picture
        docs/pictures/delighters.jpg`).*

        `--quick` takes every fourth picture and leaves the feature distance out; `--weights FILE` measures other
        weights of our network, `--opendelight FOLDER` the authors' checkpoint.
        """
    return [("", prose(setup, table(delight), reading)), ("After the solve", after_the_solve(before, now))]


def after_the_solve(before: Figures, now: Figures) -> str:
    """Return the worth of the sky for textures and solved albedos, on the captures of both records."""
    rows, shared = paired(before, now), shared_captures(before, now)
    gains = {name: now.captures[name][SOLVED].psnr - before.captures[name][SOLVED].psnr for name in shared}
    most, least = max(gains, key=gains.get), min(gains, key=gains.get)
    words = f"""
        The part of the sky's worth that the solve would have found by itself: {len(shared)} captures of [the state of
        the albedo](state.md), rendered anew and taken through a delighter that expects a sky (with `--run` first),
        beside that page's own figures, *before*. Means are over {len(rows[SOLVED])} people, each the mean of its
        captures. In the picture {sum(gain > 0 for gain in gains.values())} of {len(gains)} solved albedos came nearer
        to the truth, from {gains[least]:+.2f} dB (`{least}`) to {gains[most]:+.2f} dB (`{most}`). The solver is the
        same but for the place-dependent size of skins' traits ([the prior](prior.md)); hues in the dark were not
        settled yet.
        """
    tables = []
    for method in (DELIT, SOLVED):
        earlier = f"{method}, before"
        found = summarise({row: rows[row] for row in (earlier, method)}, SURVIVING, earlier)
        tables.append(format_table(found, SURVIVING, "taken for albedo", earlier))
    return prose(words, *tables)


def paired(before: Figures, now: Figures) -> Scores:
    """Return texture and solved albedo of both records -> person -> figures, means over the captures of both."""
    shared = shared_captures(before, now)
    people = {person: [name for name in shared if person_of(name) == person] for person in map(person_of, shared)}
    return {
        title: {person: mean_of([record.captures[name][method] for name in own]) for person, own in people.items()}
        for method in (DELIT, SOLVED)
        for title, record in ((f"{method}, before", before), (method, now))
    }


def shared_captures(before: Figures, now: Figures) -> list[str]:
    return [name for name in now.captures if name in before.captures]


def person_of(capture: str) -> str:
    """Return a capture's name without its light."""
    for light in (*likenesses.LIGHTS, *scan_captures.LIGHTS):
        capture = capture.removesuffix(f"_{light}")
    return capture


def with_error(gains: list[float]) -> str:
    """Return the mean of gains with its standard error."""
    return f"{mean(gains):+.2f} ± {stdev(gains) / len(gains) ** 0.5:.2f}"


def listed(gains: list[float]) -> str:
    return ", ".join(f"{gain:+.2f}" for gain in gains)

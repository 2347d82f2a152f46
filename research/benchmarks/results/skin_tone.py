# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/skin_tone.md: the lightness of the skin, by the whites of the eyes, without them, and with a card."""

from ..figures import Figures, markdown
from ..pages import Sections, prose

TITLE = "The skin tone"
SAYS = "The error of the estimate: 82 real people photographed anew and relit, other real pictures, simulated people."
RECORDS = ("real_tones", "skin_tone")
WAYS = ("frames", "eyes", "card")
SHOWN = ("exposed", "relit")


def sections(real: Figures, simulated: Figures) -> Sections:
    return [
        ("", _real_people(real.people)),
        ("Other real pictures", _other_pictures(real)),
        ("Simulated people", _simulated(simulated)),
    ]


def _real_people(people: Figures) -> str:
    columns = ("error ratio", "rms", "slope", "rank", "dark", "light", "stated", "within one")
    head = ["pictures", "way", "n", "with eyes", "error ratio", "rms", "slope", "rank", "dark", "light", "± stated"]
    rows = [
        [shown, way, row["all"].pictures, row["all"]["with eyes"], *(f"{row['all'][name]:.2f}" for name in columns)]
        for shown in SHOWN
        for way, row in people[shown].items()
    ]
    groups = [
        [shown, name, row.people, f"{row['L*']:.1f}", f"{row.bias:+.1f} ± {row['standard error']:.1f}"]
        + [f"{row['within one']:.2f}", row.expected]
        for shown in SHOWN
        for name, row in people[shown].eyes.items()
        if "people" in row
    ]
    angles = [
        [shown, way, *(f"{people[shown][way]['typology angle'][name]:.2f}" for name in columns[:6])]
        for shown in SHOWN
        for way in people[shown]
    ]
    ends = "; ".join(
        f"{shown}: " + ", ".join(f"{name} {value:.2f}" for name, value in people[shown].eyes["at the ends"].items())
        for shown in SHOWN
    )
    setup = """
        82 adults of the Face Research Lab London Set, all photographed under one light: what their pictures differ by
        is their skin. Each is shown twice: *exposed*, cut out over one of 20 grounds and metered anew, with a random
        exposure (by up to 0.7 stops) and white balance; *relit*, under panoramas and
        lamps. Nothing of the estimate was fitted to them. The truth of a picture is L* of its skin at the level that
        brings the white people's mean to that of measured ones (58.0). *error ratio*: squared error over that of the
        best constant; *rms* in L*; *slope* of the estimate by the truth; *rank* correlation; mean error of the darkest
        and of the lightest third; mean stated deviation and the share of errors within it.
        """
    reading = f"""
        If the studio's light was 7 % stronger or weaker and the camera's curve had an exponent of 0.85 or 1.1, the
        worst figures with eyes are: {ends}.

        The groups as the people named their own, with the interval in which the share within one deviation lies by
        chance (95 %) if the deviations hold:
        """
    return prose(
        setup,
        markdown([*head, "within one"], rows),
        reading,
        markdown(["pictures", "group", "n", "L*", "bias", "within one", "by chance"], groups),
        "The same by individual typology angle, in degrees (as Feng et al., TRUST, 2022, report it):",
        markdown(["pictures", "way", *columns[:6]], angles),
    )


def _other_pictures(real: Figures) -> str:
    olat = [
        [name, row.pictures, f"{row['L*']:.1f} ± {row.stated:.1f}", f"{row['over lights']:.1f}"]
        for name, row in real.faceolat.items()
    ]
    single = [
        [name, f"{row.lightness:.1f} ± {row.deviation:.1f}", row.group, row.source]
        for part in (real.lisa, real.captures)
        for name, row in part.items()
    ]
    return prose(
        "Two people under twelve lights each, half closed eyes and strong casts among them: the mean, and the "
        "deviation over the lights.",
        markdown(["faceolat", "pictures", "L*", "over lights"], olat),
        "One woman in eight pictures (15 cm to lisa4), and captures. The level of the whites, one number for all, was "
        "set on her and on 071 of faceolat (`research/training/tones.py`), so that their means are no test of it:",
        markdown(["picture", "L*", "group", "by"], single),
    )


def _simulated(simulated: Figures) -> str:
    columns = "lightness", "rms", "delta_e", "stated", "within_two"
    rows = [
        [way, name, figures[way].pictures, *(f"{figures[way][column]:.2f}" for column in columns)]
        for way in WAYS
        for name, figures in simulated.groups.items()
        if way in figures
    ]
    captures = [
        [name, f"{row.lightness:.1f}", row.source, f"{row.error:+.1f}", f"{row.delta_e:.1f}", f"{row.stated:.1f}"]
        for name, row in simulated.captures.items()
    ]
    setup = """
        Held-out people of `research/people/lifelike` with open eyes, from two sides in two lights each, by simulated
        phones (`research/people/exposure.py`). *frames*: the skin's own colour alone; *eyes*: with the whites of the
        eyes; *card*: with a white card before the face. Their tones are drawn from measured ones, each lightness alike.
        The lights are hard, coloured, and broken by leaves and blinds more often than people's are. Teeth and the
        exposure in a file's metadata are not used: nothing here measures what they are worth.
        """
    head = ["way", "group", "pictures", "L* mean", "L* rms", "delta E", "stated", "within two"]
    return prose(
        setup,
        markdown(head, rows),
        "Captures of known tone. Their lids are closed. A real card was not measured.",
        markdown(["capture", "L*", "by", "error", "delta E", "stated"], captures),
    )

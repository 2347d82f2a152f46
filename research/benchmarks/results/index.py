# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/index.md: the headline figures, the spread over people, and where we lose; then all pages."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module

import numpy as np

from ..captures.people import PEOPLE
from ..figures import Figures, markdown
from ..maps.comparison_table import paired
from ..maps.confidence import SHIPPED
from ..pages import Sections, prose

TITLE = "What was measured"
RECORDS = (
    "state",
    "demo",
    "relit",
    "relit_people",
    "scan_albedo",
    "costs",
    "comparison",
    "photographs",
    "whole_head",
    "real_tones",
    "confidence",
)
GROUPS = {
    "The albedo": (
        "sample",
        "relit",
        "state",
        "split",
        "scan",
        "gallery",
        "comparison",
        "rerender",
        "controlled",
        "ablation",
        "prior",
        "confidence",
        "wrong_tones",
    ),
    "Before the solve": ("geometry", "eyes", "delighters", "photographs", "shadows", "skin_tone"),
    "After the solve": ("upscale", "whole_head", "hair", "even_light", "delivery"),
    "Time and memory": ("costs",),
}
ELSEWHERE = """
    - **Elsewhere**: [promises](../promises.md), [farm](../farm.md), [cameras](../cameras.md), [scan and
      head](../scan_and_head.md), [parts](../parts.md)
    """


def sections(*records: Figures) -> Sections:
    of = Figures(zip(RECORDS, records, strict=True))
    return [
        (
            "",
            prose("""
        Every page has command, commit and day of its figures, all on 2 cores of a shared machine (25 GB; each page
        names the processor), without a GPU: seconds are upper bounds. Pictures show synthetic subjects only, and may be
        older. The sample is by today's solver and a delighter that did not yet settle [hues in the
        dark](../method/delighting.md); all other pages with delit frames but the delighters' and the photographs' are
        by one that did not yet [expect a sky](delighters.md#after-the-solve) either.
        """),
        ),
        ("In short", headline(of)),
        ("Over people", spread(of.state)),
        ("Where we lose", losses(of)),
        ("Pages", "\n".join([*(list_pages(group, names) for group, names in GROUPS.items()), prose(ELSEWHERE)])),
    ]


def list_pages(group: str, names: tuple[str, ...]) -> str:
    """Return a group's item: its pages by their titles."""
    links = (f"[{import_module(f'{__package__}.{name}').TITLE}]({name}.md)" for name in names)
    return f"- **{group}**: {'; '.join(links)}"


def over_people(summary: Figures, method: str) -> str:
    """PSNR in dB, mean and spread over the people of the state of the albedo."""
    return f"{summary[method].psnr.mean:.2f} ± {summary[method].psnr.spread:.2f}"


def headline(of: Figures) -> str:
    """Return the same answers on every set: PSNR in dB."""
    summary, sample, scan, costs = of.state.summary, of.demo.rows, of.scan_albedo.rows, of.costs
    relit, people = of.relit.sample, of.relit_people.mean

    def others(row: str) -> list[str | None]:
        return [found[row] and f"{found[row].psnr:.2f}" for found in sets]

    sets = [
        {"raw": sample["raw video"], "flat": sample["flat true tone"], "delit": None, "solved": sample.WildCap},
        {"raw": scan["raw video"], "flat": scan["flat true tone"], "delit": None, "solved": scan.WildCap},
        {**relit, "flat": None},
        {**people, "flat": None},
    ]
    rows = [
        ["the filmed texture", over_people(summary, "doing nothing"), *others("raw")],
        ["one flat colour", over_people(summary, "flat colour"), *others("flat")],
        ["the delit texture", over_people(summary, "delit texture"), *others("delit")],
        ["**WildCap**", over_people(summary, "solved"), *others("solved")],
        ["the true albedo's texture", over_people(summary, "true light"), None, None, None, None],
    ]
    head = [
        "PSNR, dB",
        f"[albedo, {summary.solved.psnr.people} people](state.md)",
        "[albedo, sample](sample.md)",
        "[albedo, head scan](scan.md)",
        "[relit, sample](relit.md)",
        "[relit, six people](relit.md)",
    ]
    return prose(
        markdown(head, rows),
        f"""
        The true skin tone is given to all; in the first column each picture gets one gain
        per channel on top. On sample and scan the filmed frames stand for their texture. A face takes
        [{costs.standard.together.minutes:.1f} minutes on 2 cores](costs.md).
        """,
    )


def spread(state: Figures) -> str:
    """Return what the solve adds to the delit texture, and how unevenly."""
    solved, captures = state.summary.solved, state.captures
    gains = {
        measure: {
            name: rows.solved[measure] - rows["delit texture"][measure]
            for name, rows in captures.items()
            if rows.solved.get(measure) is not None
        }
        for measure in ("psnr", "psnr_shared")
    }
    (worst, least), (best, most) = (
        chosen(gains["psnr_shared"].items(), key=lambda item: item[1]) for chosen in (min, max)
    )
    return prose(f"""
        Over {solved.psnr.people} people ({len(gains["psnr"])} captures) the solve adds {solved.psnr.difference:+.2f} ±
        {solved.psnr.error:.2f} dB to the delit texture in the picture (person by person, ± the standard error of the
        mean), and {solved.psnr_shared.difference:+.2f} ± {solved.psnr_shared.error:.2f} dB on the map up to one shared
        light: from {least:+.2f} dB (`{worst}`) to {most:+.2f} dB (`{best}`). Where a person was filmed in several
        lights ({solved.agreement.people} of them) it adds {solved.agreement.difference:+.2f} dB to how well the albedos
        agree. {worse_in_the_picture(gains["psnr"])} {the_synthetic(state.people.solved)} {gains_by_kind(state.people)}
        [The page](state.md).
        """)


def worse_in_the_picture(gains: dict[str, float]) -> str:
    """Return how many captures lose by the solve, and how many of these are the head scan's; gains: dB by capture."""
    worse, scanned = [name for name, gain in gains.items() if gain < 0], [name for name in gains if is_scanned(name)]
    of_scan = (
        f", among them {sum(map(is_scanned, worse))} of the {len(scanned)} of the one real scan, whose own map "
        "holds light"
        if scanned
        else ""
    )
    return f"{len(worse)} of {len(gains)} captures become worse in the picture{of_scan}."


def the_synthetic(people: Iterable[str]) -> str:
    """Return how many people are of captures/likenesses.py, and how many of captures/people.py."""
    made = [name for name in people if not is_scanned(name)]
    bald = [name for name in made if is_bald(name)]
    kinds = [(len(made) - len(bald), "with strands, eyes and a phone's pipeline"), (len(bald), "bald, by true cameras")]
    return f"The others are synthetic: {', '.join(f'{count} {what}' for count, what in kinds if count)}."


def gains_by_kind(people: Figures) -> str:
    """Return what the solve adds in the picture to the bald, and to all others; '' where there are not some of both."""
    kinds: dict[bool, list[float]] = {True: [], False: []}
    for name, solved in people.solved.items():
        kinds[is_bald(name)].append(solved["psnr"] - people["delit texture"][name]["psnr"])
    if min(map(len, kinds.values())) < 2:
        return ""
    bald, others = (
        f"{np.mean(gains):+.2f} ± {np.std(gains, ddof=1) / len(gains) ** 0.5:.2f} dB" for gains in kinds.values()
    )
    return f"To the bald, of the generator that trained the networks, the solve adds {bald}, to the others {others}."


def is_bald(name: str) -> bool:
    """Return whether a person is of research/benchmarks/captures/people.py."""
    return any(f"{name}_".startswith(f"{person.name}_") for person in PEOPLE)


def is_scanned(name: str) -> bool:
    """Return whether a capture, or a person, is of the head scan (research/benchmarks/captures/scan_captures.py)."""
    return name.startswith("scan_")


def flat_wins(rows: Figures) -> bool:
    """Return whether one flat colour is as near to a capture's truth in the picture as the solved albedo."""
    return rows["flat colour"].psnr >= rows.solved.psnr


def losses(of: Figures) -> str:
    """Return what a reader should know before the tables."""
    answers, lamps = of.state.summary, of.photographs.lamps.summary
    against = paired({name: one for name, one in of.comparison.subjects.items() if name != "scan"})["delit"]
    relit, people, tones = of.relit.sample, of.relit_people.mean, of.real_tones.people
    known = of.confidence.summary[SHIPPED]
    scalp = of.whole_head.synthetic.scalp
    return prose(f"""
        - **In {sum(map(flat_wins, of.state.captures.values()))} of {len(of.state.captures)} captures one flat colour is
          as near to the truth** in the picture as our albedo (over people {answers["flat colour"].psnr.mean:.2f} and
          {answers.solved.psnr.mean:.2f} dB, FLIP {answers["flat colour"].flip.mean:.3f} and
          {answers.solved.flip.mean:.3f}).
        - **The delighter decides**: on a bearded man under seven lamps it leaves {lamps.network.light_slope.mean:.2f}
          of a change of the light, {lamps.network.psnr.mean:.1f} dB where a flat colour has
          {lamps["flat colour"].psnr.mean:.1f} ([photographs](photographs.md)). On the head scan the solve takes beard
          and cheeks for light ([scan](scan.md)).
        - **On delit synthetic people one environment is as good a light as ours**: ours is ahead of it by
          {"{:+.2f} ± {:.2f}".format(*against["environment"]["PSNR, dB"])} dB, of ten regions by
          {"{:+.2f} ± {:.2f}".format(*against["regions 10"]["PSNR, dB"])} dB ([page](comparison.md)).
        - **Relief and gloss help little**: {relit.solved.psnr - relit.plain.psnr:+.2f} dB on the sample's relit head,
          {people.solved.psnr - people.plain.psnr:+.2f} dB over six people ([relit](relit.md)); normals and specular say
          no more than the mean face's ([prior](prior.md)).
        - **Brows and lips keep {answers.solved.kept_brows.mean:.2f} and {answers.solved.kept_lips.mean:.2f} of their
          contrast** ([state](state.md#features-kept)); edges of hard shadows leave a faint outline, the paper's own
          failure case.
        - **In hard light dark skin comes out {tones.relit.eyes.black.bias:.0f} L* too light**, in even light
          {tones.exposed.eyes.black.bias:.0f}; where no open eyes are seen, the tone is hardly known
          ([skin tone](skin_tone.md)).
        - **The confidence map knows little**: {known.gained.mean:.2f} nats more than one sigma for all, aim 0.1
          ([page](confidence.md)).
        - **A scalp that nobody saw becomes bare skin** ({scalp.completed:.0f} of 255 off where hair was;
          [whole head](whole_head.md)); a cap, or a cloth of the skin's colour, is not told from hair or skin; a
          beard's length is not measured, and stubble is told from it by a rule made with four people in view
          ([hair](hair.md)); under open lids skin is made up, which a blink shows.
        - **The prior is small**, of synthetic skins and few real ones, trained on a shared CPU ([prior](prior.md)): on
          the scan it takes fine detail with the shadow. The authors' own weights were not at hand: their loader and
          loop are verified with random ones only ([how far](../authors_prior.md)).
        - **One real skin**: all but the head scan and two sets of photographs is synthetic, by the generators that
          trained the networks (other seeds: a test reads the manifests). No real phone, no real person filmed by us.
        """)

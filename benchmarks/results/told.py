# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of texts that are written by hand: phrases that have to stand in them, numbers and all, and exactly once.

The words are the author's; where a record has another number, `texts` puts it in. A phrase may be broken over lines.
"""

from __future__ import annotations

import re
from pathlib import Path

from core.contract.messages import Problem

from .. import figures
from .index import over_people

NUMBER = r"[-+]?\d+(?:\.\d+)?"


def texts(root: Path) -> dict[Path, str]:
    """Path and text of each, with the records' numbers in its phrases. Raises Problem where one is not there once."""
    found = {}
    for name, phrases in told().items():
        text = (root / name).read_text(encoding="utf-8")
        for phrase in phrases:
            text = corrected(text, phrase, name)
        found[root / name] = text
    return found


def corrected(text: str, phrase: str, name: str) -> str:
    """The text with the phrase's numbers where the phrase stands with whatever numbers."""
    words = (r"\s+".join(map(re.escape, re.split(r" +", part))) for part in re.split(NUMBER, phrase))
    matches = list(re.finditer(f"({NUMBER})".join(words), text))
    if len(matches) != 1:
        raise Problem(
            f"{name} has the phrase {phrase!r} {len(matches)} times.",
            "Write it there once, or change it in benchmarks/results/told.py.",
        )
    for group, number in reversed(list(enumerate(re.findall(NUMBER, phrase), 1))):
        text = text[: matches[0].start(group)] + number + text[matches[0].end(group) :]
    return text


class _Published:
    """`of.NAME` are the figures of docs/figures/NAME.json."""

    def __getattr__(self, name: str) -> figures.Figures:
        return figures.Figures.of(figures.read_record(name)["figures"])


def told() -> dict[str, list[str]]:
    """The phrases of each text."""
    of = _Published()
    installed, memory, cost = of.installation, of.blender_memory, of.opendelight_cost
    return {
        "README.md": in_readme(of),
        "docs/cameras.md": in_cameras(of.geometry.lps_sun, of.head_scale),
        "docs/scan_and_head.md": in_scan_and_head(of.geometry.lps_sun, of.sample_surfaces),
        "docs/guide/install.md": [
            f"it announces {installed.told_gb:.1f} GB, and **Remove Solver**, which says first what it frees, gives "
            f"back {installed.freed_gb:.1f} GB"
        ],
        "docs/guide/relight.md": [
            f"takes {memory.shown_gb:.1f} GB of memory ({memory.empty_gb:.1f} GB empty; {memory.loading_gb:.1f} GB "
            f"while they load, {memory.mask_opened_gb:.1f} GB when a mask"
        ],
        "docs/delighters.md": [
            f"{cost.tera_multiplications:.2f} x 10^12 multiplications, three quarters of them in the decoder, and "
            f"{cost.peak_gb:.1f} GB of memory",
            f"a frame took {cost.seconds:.0f} s on two threads, while 10^12 multiplications of one large matrix "
            f"product took {cost.seconds_of_a_product:.0f} s there; a cancel was heard within "
            f"{cost.seconds_to_cancel:.1f} s",
        ],
    }


def in_readme(of: _Published) -> list[str]:
    together, answers, relit = of.costs.together, of.state.summary, of.relit.sample
    return [
        f"{of.installation.freed_gb:.1f} GB for the solver's environment, {of.demo.capture_gb:.1f} GB per face",
        f"the most that a stage took was {together.float32.peak_mb / 1000:.1f} GB",
        f"60 frames take {together.standard.minutes:.1f} minutes on {of.costs.machine.cores} CPU cores",
        f"({together.float32.minutes:.1f} without bfloat16), 300 frames {together['frames-300'].minutes:.1f}, "
        f"a draft {together.draft.minutes:.1f}",
        f"| the filmed texture | {relit.raw.psnr:.2f} dB | {over_people(answers, 'doing nothing')} dB |",
        f"| one flat colour | - | {over_people(answers, 'flat colour')} dB |",
        f"| the delit texture | {relit.delit.psnr:.2f} dB | {over_people(answers, 'delit texture')} dB |",
        f"| **WildCap** | {relit.solved.psnr:.2f} dB | {over_people(answers, 'solved')} dB |",
    ]


def in_cameras(sun: figures.Figures, scale: figures.Figures) -> list[str]:
    truth, seconds = sun.cameras.against_truth, sun.stages.cameras.seconds

    def percent(share: float) -> str:
        return f"{100 * share:+.1f} %"

    return [
        f"median centre error {truth.centre_error_median_percent:.3f} % of the camera distance, at most "
        f"{truth.centre_error_max_percent:.2f} %, rotations {truth.rotation_error_median_deg:.2f} degrees, in "
        f"{seconds:.0f} s",
        f"six synthetic heads it was set on: median {percent(scale.set_on.median)}, worst "
        f"{percent(scale.set_on.worst)}; three others: {percent(scale.others.median)}, "
        f"worst {percent(scale.others.worst)}",
        f"lids closed: {percent(scale.scan)} ({100 * scale.scan_by_corners:.1f} % by the corners of the eyes)",
    ]


def in_scan_and_head(sun: figures.Figures, sample: figures.Figures) -> list[str]:
    keys = ("median_mm", "p90_mm", "p95_mm")
    apart, phrases = sample.head_to_scan_mm, []
    for name in ("scan", "head"):
        truth = sun[name].against_truth
        rows = {
            "head scan under hard sun": [way[key] for way in (truth.by_cameras, truth.after_icp) for key in keys],
            "sample": [sample[name][before + key] for before in ("", "icp_") for key in keys],
        }
        phrases += [
            f"| {name}, {row} | {' | '.join(f'{value:.2f}' for value in values)} |" for row, values in rows.items()
        ]
    return [*phrases, f"Head to scan, median: {apart.sample:.2f} and {apart.scan:.2f} mm"]

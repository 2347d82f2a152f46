# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of texts that are written by hand: phrases that have to stand in them, numbers and all, and exactly once.

The words are the author's; where a record has another number, `texts` puts it in. A phrase may be broken over lines in the text.
"""

from __future__ import annotations

import re
from pathlib import Path

from core.contract.messages import Problem

from .. import figures

NUMBER = r"[-+]?\d+(?:\.\d+)?"


def texts(root: Path) -> dict[Path, str]:
    """Path and text of each, with the records' numbers in its phrases. Raises Problem where a phrase is not there, or more than once."""
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
        raise Problem(f"{name} has the phrase {phrase!r} {len(matches)} times.", "Write it there once, or change it in benchmarks/results/told.py.")
    for group, number in reversed(list(enumerate(re.findall(NUMBER, phrase), 1))):
        text = text[:matches[0].start(group)] + number + text[matches[0].end(group):]
    return text


class _Published:
    """`of.NAME` are the figures of docs/figures/NAME.json."""

    def __getattr__(self, name: str) -> figures.Figures:
        return figures.Figures.of(figures.read(name)["figures"])


def told() -> dict[str, list[str]]:
    """The phrases of each text."""
    of = _Published()
    together, installed, answers = of.costs.together, of.installation, of.state.summary
    sun, surfaces, scale, memory, cost = of.geometry.lps_sun, of.sample_surfaces, of.head_scale, of.blender_memory, of.opendelight_cost
    truth, relit = sun.cameras.against_truth, of.relit.sample
    return {
        "README.md": [
            f"{installed.freed_gb:.1f} GB for the solver's environment, {of.demo.capture_gb:.1f} GB per face",
            f"the most that a stage took was {together.float32.peak_mb / 1000:.1f} GB",
            f"60 frames take {together.standard.minutes:.1f} minutes on {of.costs.machine.cores} CPU cores",
            f"({together.float32.minutes:.1f} without bfloat16), 300 frames {together['frames-300'].minutes:.1f}, a draft {together.draft.minutes:.1f}",
            *(f"| {label} | {relit[row].psnr:.2f} dB | {answers[method].psnr.mean:.2f} ± {answers[method].psnr.spread:.2f} dB |"
              for label, row, method in (("the filmed texture", "raw", "doing nothing"), ("the delit texture", "delit", "delit texture"),
                                         ("**WildCap**", "solved", "solved"))),
            f"| one flat colour | - | {answers['flat colour'].psnr.mean:.2f} ± {answers['flat colour'].psnr.spread:.2f} dB |"],
        "docs/cameras.md": [
            f"median centre error {truth.centre_error_median_percent:.3f} % of the camera distance, at most {truth.centre_error_max_percent:.2f} %, "
            f"rotations {truth.rotation_error_median_deg:.2f} degrees",
            f"six synthetic heads it was set on: median {100 * scale.set_on.median:+.1f} %, worst {100 * scale.set_on.worst:+.1f} %; "
            f"three others: {100 * scale.others.median:+.1f} %, worst {100 * scale.others.worst:+.1f} %",
            f"lids closed: {100 * scale.scan:+.1f} % ({100 * scale.scan_by_corners:.1f} % by the corners of the eyes)"],
        "docs/scan_and_head.md": [
            *("| {}, head scan under hard sun | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |".format(
                name, *(found[key] for found in (sun[name].against_truth.by_cameras, sun[name].against_truth.after_icp)
                        for key in ("median_mm", "p90_mm", "p95_mm"))) for name in ("scan", "head")),
            *("| {}, sample | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |".format(
                name, *(surfaces[name][key] for key in ("median_mm", "p90_mm", "p95_mm", "icp_median_mm", "icp_p90_mm", "icp_p95_mm")))
              for name in ("scan", "head")),
            f"Head to scan, median: {surfaces.head_to_scan_mm.sample:.2f} and {surfaces.head_to_scan_mm.scan:.2f} mm"],
        "docs/guide/install.md": [f"{installed.told_gb:.1f} GB are told, {installed.freed_gb:.1f} GB come off again"],
        "docs/guide/relight.md": [
            f"takes {memory.shown_gb:.1f} GB of memory ({memory.empty_gb:.1f} GB empty; {memory.loading_gb:.1f} GB while they load, "
            f"{memory.mask_opened_gb:.1f} GB when a mask"],
        "docs/delighters.md": [
            f"{cost.tera_multiplications:.2f} x 10^12 multiplications, three quarters of them in the decoder, and {cost.peak_gb:.1f} GB of memory",
            f"a frame took {cost.seconds} s on two threads, while 10^12 multiplications of one large matrix product took "
            f"{cost.seconds_of_a_product} s there; a cancel was heard within {cost.seconds_to_cancel:.1f} s"],
    }

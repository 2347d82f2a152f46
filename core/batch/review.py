# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""review.html: the faces of a batch on one page, in the order in which to look at them.

Faces whose skin tone is open come first, then stopped ones, those that wait for the artist, and the others; within
each, the riskiest first. A measure of a face is ranked by the share of the other faces that are better, as no
thresholds have been measured. The worst rank of a face is its risk, since one failure spoils a head and a mean would
hide it; the mean breaks ties.

Pictures are embedded as thumbnails: the page loads nothing and can be sent.
"""

from __future__ import annotations

import base64
import contextlib
import html
import os
import tempfile
import time
import urllib.parse
from dataclasses import dataclass
from pathlib import Path

from .. import __version__
from ..capture import report, tone_choice
from ..capture.capture import Capture
from ..capture.files import replacing, storage_problem
from ..capture.messages import Problem
from .groups import GROUPS
from .record import Batch, BatchFace
from .review_page import MARK, PAGE, STYLE
from .state import DONE, STOPPED, TO_DO, WAITING, WORKING, FaceState, derive_state

NAME = "review.html"


@dataclass(frozen=True)
class Measure:
    """A figure of a stage in capture.json; `worse` is 1 if more of it is riskier, else -1."""

    label: str
    stage: str
    figure: str
    unit: str
    worse: int
    note: str


FINDINGS = "Findings"
MEASURES = (
    Measure(FINDINGS, "", "", "", 1, "What the stages found wrong with the film"),
    Measure(
        "Mask",
        "shadow_mask",
        "masked_percent",
        " %",
        1,
        "Share of the face that the proposed mask covers: there the albedo is guessed from the rest",
    ),
    Measure(
        "Landmarks",
        "registration",
        "landmark_residual_mm",
        " mm",
        1,
        "How far the fitted head's landmarks lie from those seen in the frames: the median",
    ),
    Measure("Seen", "texture", "seen_percent", " %", -1, "Share of the head that the frames show with confidence"),
    Measure(
        "Explained", "solve", "residual_psnr_db", " dB", -1, "How well the solved maps and light give the texture again"
    ),
)
PICTURES = (
    ("registration", "registration_*.jpg", "The head over the frames"),
    ("shadow_mask", "shadow_mask_*.jpg", "As filmed, what was found, the mask"),
    ("solve", "solve_texture*.jpg", "Texture, albedo, shading"),
)
"""Stage, its picture in CAPTURE/report, and a caption."""
FIRST_PICTURE = ("frames", "frames_*.jpg", "Frames")
"""Shown until there is one of the others."""
THUMBNAIL_PX, QUALITY = 160, 80
"""Height and JPEG quality: some 40 KB per face, 10 MB for 200 faces."""
TALLEST_REM = 10
"""Greatest height on the page: as many pixels as a thumbnail has."""
ORDER = (STOPPED, WAITING)
TONE = "tone"
HEADINGS = {
    TONE: "Choose the skin tone",
    STOPPED: "Stopped",
    WAITING: "Waiting for the artist",
    "": "The others, the riskiest first",
}
STATES = {DONE: "done", TO_DO: "to do", WORKING: "being worked on", WAITING: "waiting", STOPPED: "stopped"}


@dataclass(frozen=True)
class ReviewRow:
    """One face: values and ranks (share of the others that are better, [0, 1]) by a measure's label, and findings.

    is_tone_open: the estimate of the skin tone spans more swatches than it may, and nobody has chosen one.
    """

    face: BatchFace
    state: FaceState
    seconds: float
    values: dict[str, float]
    ranks: dict[str, float]
    findings: list[dict]
    is_tone_open: bool = False

    @property
    def risk(self) -> tuple[float, float]:
        """Worst rank and mean of all; zeros for a face without figures."""
        return (max(self.ranks.values()), sum(self.ranks.values()) / len(self.ranks)) if self.ranks else (0.0, 0.0)

    @property
    def worst(self) -> str:
        """Label of the measure with the worst rank; '' if no other face is better in any."""
        return max(self.ranks, key=self.ranks.__getitem__, default="") if self.risk[0] > 0 else ""

    def words(self) -> str:
        """Return the worst measure as in "mask 43 %, worse than 98 % of the others", or what is to be chosen."""
        if self.is_tone_open:
            return "its skin tone waits to be chosen"
        if not self.worst:
            return "nothing is worse than in the others"
        others = "all others" if self.risk[0] == 1 else f"{self.risk[0]:.0%} of the others"
        return f"{self.worst.lower()} {_shown(self, self.worst)}, worse than {others}"


def write_review(batch: Batch) -> tuple[Path, list[ReviewRow]]:
    """Write BATCH/review.html; return its path, and the faces in its order.

    Raises Problem if it cannot be written or would replace another file.
    """
    path = batch.root / NAME
    if os.path.lexists(path) and not _is_ours(path):
        raise Problem(f"{path} is not a page that WildCap wrote.", "Move it away, then write the review again.")
    rows = sort_rows(read_rows(batch))
    sections = {heading: [row for row in rows if _heading(row) == heading] for heading in HEADINGS}
    counts = {state: sum(row.state.state == state for row in rows) for state in STATES}
    page = PAGE.format(
        mark=MARK,
        title=html.escape(batch.root.name),
        style=STYLE,
        sections="".join(_section(heading, rows, batch) for heading, rows in sections.items()),
        version=__version__,
        written=time.strftime("%Y-%m-%d %H:%M"),
        counts="".join(
            f'<span class="badge {_kind(state)}">{count} {STATES[state]}</span>'
            for state, count in counts.items()
            if count
        ),
        faces=f"{len(rows)} face{'' if len(rows) == 1 else 's'}",
        time=_duration(sum(row.seconds for row in rows)),
    )
    with replacing(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return path, rows


def _heading(row: ReviewRow) -> str:
    """Return the key of a row's section in HEADINGS."""
    if row.state.state in ORDER:
        return row.state.state
    return TONE if row.is_tone_open else ""


def _is_ours(path: Path) -> bool:
    """Return whether WildCap wrote a page. Raises Problem if it cannot be read."""
    try:
        return MARK in path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise storage_problem(error, path) from error


def read_rows(batch: Batch) -> list[ReviewRow]:
    """Read the captures' records, in the batch's order; a record that cannot be read counts as empty."""
    records, measured, found, tones = [], [], [], []
    for face in batch.faces:
        record, is_tone_open = {"stages": {}}, False
        with contextlib.suppress(Problem):
            record = face.capture.read()
            is_tone_open = tone_choice.asks_for_choice(record, face.chosen().solve.skin_tone)
        tones.append(is_tone_open)
        findings = [finding for finding in report.findings(record) if not finding["stopped"]]
        records.append(record["stages"])
        measured.append(_measure(record["stages"], len(findings)))
        found.append(findings)
    return [
        ReviewRow(face, derive_state(batch, face), sum(entry["seconds"] for entry in stages.values()), *rest)
        for face, stages, *rest in zip(batch.faces, records, measured, rank(measured), found, tones, strict=True)
    ]


def _measure(stages: dict[str, dict], findings: int) -> dict[str, float]:
    """Return the measures that finished stages have valid figures for."""
    values: dict[str, float] = {FINDINGS: findings} if stages else {}
    for measure in MEASURES:
        value = stages.get(measure.stage, {}).get("figures", {}).get(measure.figure)
        if isinstance(value, int | float) and value == value:  # not NaN
            values[measure.label] = value
    return values


def rank(measured: list[dict[str, float]]) -> list[dict[str, float]]:
    """Return for each face and measure the share of the other faces with that measure that are better, in [0, 1]."""
    ranks: list[dict[str, float]] = [{} for _ in measured]
    for measure in MEASURES:
        risks = {i: own[measure.label] * measure.worse for i, own in enumerate(measured) if measure.label in own}
        for i, risk in risks.items():
            ranks[i][measure.label] = sum(other < risk for other in risks.values()) / max(len(risks) - 1, 1)
    return ranks


def sort_rows(rows: list[ReviewRow]) -> list[ReviewRow]:
    """Sort by section, then by risk, then by name."""
    sections = list(HEADINGS)
    return sorted(rows, key=lambda row: (sections.index(_heading(row)), *(-share for share in row.risk), row.face.name))


def _section(state: str, rows: list[ReviewRow], batch: Batch) -> str:
    if not rows:
        return ""
    cards = "".join(_card(row, batch) for row in rows)
    return f"<section><h2>{HEADINGS[state]} <small>{len(rows)}</small></h2>{cards}</section>"


def _card(row: ReviewRow, batch: Batch) -> str:
    state, name = row.state, html.escape(row.face.name)
    link = _link(row.face.capture.report, batch.root)
    title = f'<a href="{link}">{name}</a>' if link else name
    left = [group.label for group in GROUPS[GROUPS.index(state.group) :]] if state.group else []
    still = f"; still to do: {', '.join(left).lower()}" if left else ""
    words = f"{_duration(row.seconds)} of work{still}" + (f"; on {state.machine}" if state.machine else "")
    problem = f'<p class="problem">{_sentences(state.problem, state.remedy)}</p>' if state.state == STOPPED else ""
    bullets = "".join(f"<li>{_sentences(each['problem'], each['remedy'])}</li>" for each in row.findings)
    count = f"{len(row.findings)} finding{'' if len(row.findings) == 1 else 's'}"
    findings = f"<details><summary>{count}</summary><ul>{bullets}</ul></details>" if bullets else ""
    return (
        f'<article><div class="told"><h3>{title} <span class="badge '
        f'{_kind(state.state)}">{STATES[state.state]}</span></h3>'
        f'<p class="when">{html.escape(words)}</p>{problem}{_bars(row)}{findings}</div><div '
        f'class="seen">{_thumbnails(row.face.capture, link)}</div></article>'
    )


def _sentences(problem: str, remedy: str) -> str:
    return f"{html.escape(problem)} <b>{html.escape(remedy)}</b>"


def _kind(state: str) -> str:
    return state.replace(" ", "-")


def _bars(row: ReviewRow) -> str:
    """Return a table with a row per measure: its value, and its rank as a bar."""
    lines = "".join(
        f'<tr title="{html.escape(measure.note)}"{" class=worst" if measure.label == row.worst else ""}>'
        f'<th>{measure.label}</th>'
        f'<td>{_shown(row, measure.label)}</td><td class="bar"><i '
        f'style="width:{row.ranks[measure.label]:.0%}"></i></td></tr>'
        for measure in MEASURES
        if measure.label in row.values
    )
    return f"<table>{lines}</table>" if len(row.values) > 1 else ""


def _shown(row: ReviewRow, label: str) -> str:
    return f"{row.values[label]:.4g}{next(measure.unit for measure in MEASURES if measure.label == label)}"


def _thumbnails(capture: Capture, link: str) -> str:
    pictures = [
        (stage, path, words)
        for stage, pattern, words in PICTURES
        for path in sorted(capture.pictures.glob(pattern))[:1]
    ]
    renders = [path for path in capture.renders.glob("[!.]*") if path.suffix.lower() in (".jpg", ".jpeg", ".png")]
    pictures += [("", path, "Render") for path in sorted(renders, key=lambda path: path.stat().st_mtime)[-1:]]
    if not pictures:
        stage, pattern, words = FIRST_PICTURE
        pictures = [(stage, path, words) for path in sorted(capture.pictures.glob(pattern))[:1]]
    markup = ""
    for stage, path, words in pictures:
        with contextlib.suppress(Problem, OSError):  # a damaged picture is left out
            content, aspect = shrink(path)
            picture = (
                f'<img loading="lazy" alt="{html.escape(capture.root.stem)}: {words}" title="{words}" '
                f'src="data:image/jpeg;base64,{base64.b64encode(content).decode("ascii")}">'
            )
            picture = f'<a href="{link}{f"#{stage}" if stage else ""}">{picture}</a>' if link else picture
            markup += f'<div style="flex:{aspect:.3f} 1 0;max-width:{aspect * TALLEST_REM:.2f}rem">{picture}</div>'
    return markup


def shrink(path: Path) -> tuple[bytes, float]:
    """Return a picture as a JPEG of at most THUMBNAIL_PX rows, and its aspect ratio. Raises Problem."""
    from ..imaging import images  # needs OpenImageIO

    picture = images.read_srgb(path)
    height = min(THUMBNAIL_PX, len(picture))
    with tempfile.TemporaryDirectory(prefix="wildcap_review_") as folder:
        small, width = Path(folder) / "small.jpg", max(1, round(picture.shape[1] * height / len(picture)))
        images.write_srgb(small, images.resize(picture, width, height), quality=QUALITY)
        return small.read_bytes(), picture.shape[1] / len(picture)


def _link(page: Path, root: Path) -> str:
    """Return an address relative to the batch's folder; '' if the page is missing or on another drive."""
    if not page.is_file():
        return ""
    try:
        return html.escape(urllib.parse.quote(Path(os.path.relpath(page, root)).as_posix()))
    except ValueError:
        return ""


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes / 60:.1f} h"


def list_riskiest(rows: list[ReviewRow], most: int = 5) -> list[str]:
    """Return lines for the terminal: the first faces of the page, each with the reason."""
    return [
        f"{row.face.name:20} {row.state.words() if row.state.state in ORDER else row.words()}" for row in rows[:most]
    ]

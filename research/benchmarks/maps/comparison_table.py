# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of research/benchmarks/maps/comparison.py."""

import numpy as np

from .. import figures
from ..measures.table import mean

INPUTS = ("delit", "raw")
OURS = "wildcap"
COLUMNS = {
    "PSNR": lambda s: s["raw"]["psnr"],
    "after one gain": lambda s: s["gain"]["psnr"],
    "SSIM": lambda s: s["gain"]["ssim"],
    "FLIP": lambda s: s["gain"]["flip"],
    "detail": lambda s: s["detail"],
    "shadow step": lambda s: s["shadow_step"],
}


def means(subjects: list[dict]) -> dict:
    """Return input -> method -> column -> mean over subjects, and "spread", half the difference of two seeds."""
    out: dict = {
        given: {
            method: {
                column: mean([value(one[given][method]["0"]) for one in subjects]) for column, value in COLUMNS.items()
            }
            for method in subjects[0][given]
        }
        for given in subjects[0]
    }
    two = [one["delit"][OURS] for one in subjects]
    return out | {
        "spread": {
            column: mean([abs(value(s["0"]) - value(s["1"])) / 2 for s in two if value(s["0"]) is not None])
            for column, value in COLUMNS.items()
        }
    }


def table(record: dict) -> str:
    """Return Markdown: a line per row with means over people, best and ties in bold for each input; then the scan's."""
    parts = []
    for key, title in (("people", "mean of the people"), ("scan", "head scan")):
        if key not in record:
            continue
        lines, spread = [], record[key]["spread"]
        for given in INPUTS:
            rows = record[key].get(given, {})
            for method, cells in rows.items():
                line = [
                    _cell(column, cells[column], [r[column] for r in rows.values()], spread[column])
                    for column in COLUMNS
                ]
                lines.append([f"{given}: {method}", *line])
        lines.append(["*spread over seeds*", *(_text(column, spread[column]) for column in COLUMNS)])
        parts.append(figures.markdown([title, *COLUMNS], lines))
    return "\n\n".join(parts)


DIFFERENCES = {
    "PSNR, dB": ("raw", "psnr", "{:+.2f} ± {:.2f}"),
    "after one gain, dB": ("gain", "psnr", "{:+.2f} ± {:.2f}"),
    "FLIP": ("gain", "flip", "{:+.4f} ± {:.4f}"),
}


def paired(subjects: dict[str, dict]) -> dict:
    """Return ours less each other method: input -> method -> column -> mean and its standard error.

    subjects: name -> figures of comparison.compare_methods.
    """

    def differences(given: str, method: str, about: str, figure: str) -> tuple[float, float]:
        gains = [
            one[given][OURS]["0"][about][figure] - one[given][method]["0"][about][figure] for one in subjects.values()
        ]
        return float(np.mean(gains)), float(np.std(gains, ddof=1) / len(gains) ** 0.5)

    return {
        given: {
            method: {
                column: differences(given, method, about, figure) for column, (about, figure, _) in DIFFERENCES.items()
            }
            for method in methods
            if method != OURS
        }
        for given, methods in next(iter(subjects.values())).items()
    }


def paired_table(subjects: dict[str, dict]) -> str:
    """Return Markdown of `paired`: bold if better by two standard errors, italic if worse by one."""
    lines = []
    for given, methods in paired(subjects).items():
        for method, found in methods.items():
            line = [f"{given}: less {method}"]
            for column, (gain, error) in found.items():
                text, better = DIFFERENCES[column][2].format(gain, error), -gain if column == "FLIP" else gain
                line.append(f"**{text}**" if better > 2 * error else f"*{text}*" if better < -error else text)
            lines.append(line)
    return figures.markdown(["ours, person by person", *DIFFERENCES], lines)


def _cell(column: str, figure: float | None, column_values: list[float | None], spread: float | None) -> str:
    others = [_badness(column, v) for v in column_values if v is not None]
    text = _text(column, figure)
    return f"**{text}**" if figure is not None and _badness(column, figure) <= min(others) + (spread or 0) else text


def _badness(column: str, figure: float) -> float:
    return abs(figure) if column == "shadow step" else figure if column == "FLIP" else -figure


def _text(column: str, figure: float | None) -> str:
    return figures.number(figure, 3 if column in ("SSIM", "FLIP") else 2) or "-"

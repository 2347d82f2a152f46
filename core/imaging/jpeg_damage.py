# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Damage within a JPEG that its decoder does not notice: a wrong bit, or a part that is gone.

A block's brightness is stored as the difference to the one before it, so that from a wrong block on, to the picture's
end, all blocks are too dark, too bright or displaced. The edge of that runs along a row of blocks to the right, and
goes on below to the left, one pixel sharp, as no lens draws it.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

LEAST_JUMP = 1.5 / 255
"""Jump between two rows of pixels at the edge of a block, beyond twice those beside it, that counts."""
USUAL_SHARE = 0.95
"""Share of the edges of blocks whose jumps are usual: a strongly compressed picture has many."""
LEAST_SHARE = 0.3
"""Share of the blocks along such an edge that jump from which it is damage. Of 240 real JPEGs the worst has 0.2; of 25
with a wrong bit or a hole that changes more than 3 codes in the mean, which their decoder did not notice, 21 have more
than 0.55."""
LEAST_SEAM, MOST_WRAPPED = 0.45, 5.0
"""Share of the last rows that jump at a seam, and difference of a row's end to the next one's beginning as
a multiple of that of neighbouring pixels, of a displaced picture. None of 225 real JPEGs is one by both."""
SAMPLES = 4
"""Pixels looked at of a block's row."""
LEAST_DETAIL = 0.02
"""Standard deviation along a picture's border, below which its two ends are alike anyhow."""
SEAM_ROWS = 40
"""Rows of blocks looked at for a seam: the lower half, but no more."""
LEAST_BLOCKS = 8
BORDER = 3
"""Blocks at either end of a row where an edge is hardly one of two rows."""
FINE_PX, CLIPPED, LEAST_OPEN, LIKE = 31, 0.02, 0.1, 0.5
"""Detail of a row is finer than so many pixels; how near to black and white it tells nothing, the share of a row that
has to tell something, and the correlation of two rows that show the same."""
FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Markers of a frame's header (ITU-T T.81, table B.1)."""
SEQUENTIAL, TABLES, SCAN = {0xC0, 0xC1}, 0xC4, 0xDA
EMPTY_BLOCK = 0
"""Symbol of the end of a block: without another one before it the block is of one colour."""
HOLE = bytes(64)
"""More zeros than two blocks could need, all of whose coefficients are -1."""


def is_damaged(pixels: np.ndarray, path: Path) -> bool:
    """Return whether a JPEG's pixels [H, W, C], as stored, show such an edge or seam, or its data has a hole."""
    return edge_share(pixels, path) > LEAST_SHARE or is_displaced(pixels, path) or has_hole(path)


def is_displaced(pixels: np.ndarray, path: Path) -> bool:
    """Return whether the lower part of a JPEG's pixels is displaced: a seam runs down it.

    It is where the picture's right end has come in at the left, and there each row goes on at the left of the next one.
    """
    width, height = block_size(path)
    rows, columns = pixels.shape[0] // height, pixels.shape[1] // width
    if min(rows, columns) < LEAST_BLOCKS:
        return False
    lower = pixels[(rows - min(rows // 2, SEAM_ROWS)) * height : rows * height, : columns * width]
    jumps = _jumps(lower.swapaxes(0, 1), height, width)
    seam = (jumps > max(LEAST_JUMP, np.quantile(jumps, USUAL_SHARE))).mean(1).max(initial=0)
    blocks = lower.reshape(-1, height, *lower.shape[1:])
    last, first = blocks[:-1, :, -1].mean(1), blocks[1:, :, 0].mean(1)
    inside = blocks[:, :, width // 2 :: width].mean(1), blocks[:, :, width // 2 + 1 :: width].mean(1)
    usual = np.median(np.abs(inside[1] - inside[0]).max(-1))
    if np.std(first, axis=0).max() < LEAST_DETAIL:  # bars on both sides
        return False
    return bool(seam > LEAST_SEAM and np.median(np.abs(first - last).max(-1)) < MOST_WRAPPED * usual)


def has_hole(path: Path) -> bool:
    """Return whether a JPEG's data has zeros for long, as a card leaves them, that its codes cannot mean.

    In all tables the code of zeros alone would have to be that of an empty block.
    """
    headers, data = _read_header(path)
    return bool(SEQUENTIAL & headers.keys()) and _first_symbols(headers) != {EMPTY_BLOCK} and HOLE in data


def edge_share(pixels: np.ndarray, path: Path) -> float:
    """Return the share of blocks that jump along the likeliest such edge, less those beyond it; of its worse part."""
    width, height = block_size(path)
    if min(pixels.shape[0] // height, pixels.shape[1] // width) < LEAST_BLOCKS:
        return 0.0
    jumps = _jumps(pixels, width, height)
    high = jumps > max(LEAST_JUMP, np.quantile(jumps, USUAL_SHARE))
    count = high.shape[1]
    before = np.pad(np.cumsum(high, 1), ((0, 0), (1, 0)))  # [rows, count + 1], high ones left of each place
    after = before[:, -1:] - before
    place = np.arange(count + 1)[BORDER:-BORDER]
    # from one place on in a row, up to there in the next: a frame's edge is in one row alone
    right, left = (after[:-1] - after[1:])[:, place], (before[1:] - before[:-1])[:, place]
    shares = np.minimum(np.minimum(right / (count - place), left / place), (right + left) / count)
    whole = (after[:-1] - after[1:])[:, 0] / count
    along = [
        whole[row]
        for row in np.flatnonzero(whole > LEAST_SHARE)
        if _goes_on(pixels[:, : count * width], (row + 1) * height, np.repeat(high[row], width))
    ]
    return float(max(shares.max(initial=0), max(along, default=0)))


def _goes_on(pixels: np.ndarray, row: int, jumps: np.ndarray) -> bool:
    """Return whether what a row of pixels shows goes on in the one above it, but for its brightness, where that jumps.

    So it does below an edge of damage that begins at a row's end; beyond one of a frame or a horizon it is another.
    """
    lines = pixels[row - 1 : row + 1].mean(-1)
    fine = lines - cv2.blur(lines, (FINE_PX, 1))
    open_ = jumps & (np.abs(lines - 0.5) < 0.5 - CLIPPED).all(0)  # by the shift, others are white or black
    if open_.mean() < LEAST_OPEN or fine[:, open_].std(1).min() < LEAST_JUMP:
        return False
    return bool(np.corrcoef(fine[:, open_])[0, 1] > LIKE)


def block_size(path: Path) -> tuple[int, int]:
    """Return width and height in pixels of what a JPEG stores together; 8 x 8 if its header does not tell."""
    headers, _ = _read_header(path)
    for frame in (content for marker, contents in headers.items() if marker in FRAMES for content in contents):
        samplings = [frame[at] for at in range(7, min(len(frame), 6 + 3 * frame[5]), 3)] if len(frame) > 5 else []
        if len(samplings) > 1:
            return tuple(8 * max(1, *each) for each in zip(*((s >> 4, s & 15) for s in samplings), strict=True))
    return 8, 8


def _read_header(path: Path) -> tuple[dict[int, list[bytes]], bytes]:
    """Return the contents of a JPEG's segments before its first scan by their markers, and what follows."""
    content, at = Path(path).read_bytes(), 2
    segments: dict[int, list[bytes]] = {}
    while at + 4 <= len(content) and content[at] == 0xFF and content[at + 1] != SCAN:
        size = int.from_bytes(content[at + 2 : at + 4], "big")
        segments.setdefault(content[at + 1], []).append(content[at + 4 : at + 2 + size])
        at += 2 + max(size, 2)
    return segments, content[at:]


def _first_symbols(headers: dict[int, list[bytes]]) -> set[int]:
    """Return the symbols whose code is of zeros alone in the tables of coefficients (T.81, B.2.4.2)."""
    symbols = set()
    for tables in headers.get(TABLES, []):
        while len(tables) > 17:
            count = sum(tables[1:17])
            symbols |= {tables[17]} if tables[0] >> 4 else set()
            tables = tables[17 + count :]
    return symbols


def _jumps(pixels: np.ndarray, width: int, height: int) -> np.ndarray:
    """Return the jump [rows, blocks] of a block's mean rows across each edge, beyond twice that beside it."""
    edges = (pixels.shape[0] - 3) // height
    blocks = pixels.shape[1] // width
    samples = pixels[:, : blocks * width : width // SAMPLES]
    rows = []
    for place in (-2, -1, 0, 1):
        row = samples[height + place :: height][:edges].reshape(edges, blocks, SAMPLES, -1)
        rows.append(sum(row[:, :, i] for i in range(SAMPLES)) / SAMPLES)
    above, across, below = (np.abs(second - first) for first, second in zip(rows, rows[1:], strict=False))
    return (across - 2 * np.maximum(above, below)).max(-1)

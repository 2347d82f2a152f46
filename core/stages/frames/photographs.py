# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs in order of their names, upright, in sRGB by the colours that their files state, raw ones developed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...capture.messages import Problem, Reporter, name_some
from ...capture.photographs import Photographs, list_photographs
from ...capture.picture_kinds import RAW, kind_of
from ...imaging import focal, images, raw
from .colour import from_stated
from .source import Picture, evenly, fit

FEATURES_PX = 2000
"""Longer side of the pictures that cameras are found by: of photographs far apart only fine features match."""
LEAST_PX, LEAST_CONTRAST = 48, 1 / 255
"""Shorter side, and standard deviation of the values, of pictures that show something."""
SEQUENCE_FPS = 24.0
"""Of a numbered sequence, whose rate no file states; only the order matters."""
AS_JPEG = "Export them as JPEG or PNG."


@dataclass
class _Tally:
    """Account of the pictures read so far.

    left_out: name -> remedy; unknown: profile -> names; doubted: number of those with a focal length that is not
    believed; developed: of raw ones; assumed: of those whose primaries are assumed.
    """

    left_out: dict[str, str] = field(default_factory=dict)
    unknown: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    doubted: int = 0
    developed: int = 0
    assumed: int = 0


def read_photographs(source: Path, most: int, long_side: int, report: Reporter) -> Iterator[Picture]:
    """Yield at most `most` photographs of a source, evenly spread, shrunk to `long_side` pixels.

    `source` is a picture, a folder of them, or one with a folder for each camera. What is not read is named in a
    finding. Raises Problem if there are none, or none can be read.
    """
    listed, tally = list_photographs(source), _Tally()
    _require_pictures(listed, source)
    chosen = evenly(len(listed.files), most)
    full_px = long_side if listed.is_sequence else max(FEATURES_PX, long_side)
    for done, index in enumerate(chosen, 1):
        path = listed.files[index]
        name = listed.name(path)
        read = _read(path, name, full_px, tally, report)
        if read is None:
            continue
        full, told, exposure = read
        srgb = fit(full, long_side)
        focal_px = None if told.mm35 is None else round(focal.to_pixels(told.mm35, *srgb.shape[1::-1]), 2)
        yield Picture(
            srgb,
            int(index),
            index / SEQUENCE_FPS if listed.is_sequence else None,
            name,
            focal_px,
            done,
            len(chosen),
            full if full.shape != srgb.shape else None,
            exposure,
            told,
        )
    if len(tally.left_out) == len(chosen):
        what = f"{source.name} could not" if source.is_file() else f"None of the photographs in {source.name} could"
        raise Problem(f"{what} be read.", next(iter(tally.left_out.values())))
    _tell_unread(listed, len(chosen), tally.left_out, report)
    _tell_claims(tally, report)


def _read(
    path: Path, name: str, long_side: int, tally: _Tally, report: Reporter
) -> tuple[np.ndarray, focal.Focal, float | None] | None:
    """Return a photograph in sRGB at no more than `long_side` pixels, and its metadata; None if it is left out."""
    try:
        stored, colour = images.read_stored(path, thorough=True)
        told, exposure = images.read_metadata(path)
    except Problem as problem:
        report.log(f"{name} is left out: {problem.problem}")
        tally.left_out[name] = problem.remedy
        return None
    if min(stored.shape[:2]) < LEAST_PX or np.std(stored[::8, ::8]) < LEAST_CONTRAST:
        report.log(f"{name} is left out: it is of one colour, or smaller than {LEAST_PX} pixels.")
        tally.left_out[name] = "Leave out pictures that show nothing."
        return None
    tally.developed += kind_of(path) == RAW
    tally.assumed += colour.assumed
    if colour.unknown:
        tally.unknown[colour.unknown].append(name)
    if told.doubt:
        tally.doubted += 1
        report.log(f"{name}: a focal length in its metadata is not used: {told.doubt}.")
    return from_stated(fit(stored, long_side), colour), told, exposure


def _tell_claims(tally: _Tally, report: Reporter) -> None:
    """Report how raw pictures were developed, and which statements of the files were not used or missing."""
    if tally.assumed:
        report.log(f"{tally.assumed} pictures with floats state no chromaticities; they are taken for linear Rec. 709.")
    if tally.developed:
        report.figure("raw_development", raw.DEVELOPMENT)
    if tally.doubted:
        report.figure("focal_lengths_not_believed", tally.doubted)
    for profile, names in tally.unknown.items():
        report.finding(
            f"The colours of {name_some(names)} are taken for sRGB, but their profile is {profile}.",
            "Export them in sRGB, Display P3 or Adobe RGB.",
        )


def _require_pictures(listed: Photographs, source: Path) -> None:
    """Raise Problem if there is nothing to read."""
    if listed.files:
        return
    if listed.unread:
        raise Problem(f"The photographs in {source.name} are {_kinds(listed)} files, which are not supported.", AS_JPEG)
    raise Problem(
        f"There are no photographs in {source}.",
        "Choose a folder with JPEG, HEIC, PNG, TIFF, WebP, EXR or raw pictures of the face, one picture, or a video.",
    )


def _kinds(listed: Photographs) -> str:
    return " and ".join(sorted(listed.unread, reverse=True))


def _tell_unread(listed: Photographs, chosen: int, left_out: dict[str, str], report: Reporter) -> None:
    """Report how many pictures were read of how many, and what was not."""
    unread = [listed.name(path) for paths in listed.unread.values() for path in paths]
    total = len(listed.files) + len(unread)
    report.figure("photographs_read", f"{chosen - len(left_out)} of {total}")
    report.log(f"{chosen - len(left_out)} of {total} photographs were read.")
    if unread:
        report.finding(
            f"{len(unread)} {_kinds(listed)} files were left out: {name_some(unread)}. "
            f"{chosen - len(left_out)} of {total} photographs were read.",
            AS_JPEG,
        )
    if listed.doubled:
        report.log(f"{len(listed.doubled)} pictures are left out, whose shots are there in another format as well.")
    if listed.moment:
        report.log(
            f"The folders are cameras with {listed.moments} frames each; frame {listed.moment}, at which all show the "
            "same moment, is read of each."
        )
    if left_out:
        report.finding(
            f"{len(left_out)} of {chosen} photographs could not be read: {name_some(list(left_out))}.",
            next(iter(left_out.values())),
        )

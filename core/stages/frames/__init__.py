# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage frames: sharp frames of one exposure from a video or photographs, with the head's turn in each.

frames.json (capture/frame_records.py) describes the written frames, to which the gains have already been applied: every
stage, and any tool that is given the folder, sees one exposure.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...capture.capture import Capture
from ...capture.files import replacing_folder
from ...capture.frame_records import FULL, PHOTOGRAPHS, VIDEO, FrameRecord, Frames, write_frames
from ...capture.messages import Problem, Reporter, name_some
from ...capture.photographs import is_photograph
from ...face import faces
from ...face.glasses import sureness
from ...imaging import images
from ...settings.settings import Settings
from .doctor import FEW_FRAMES, FIND_FACE, blurred, diagnose, examine
from .drift import content_of, gains_of
from .eyes import blinks
from .glasses import judge
from .pictures import read_source
from .select import select_views, sharpness, turns
from .source import Picture
from .zoom import features_of, zooms_of

FEWEST_FRAMES = 3
"""Of a video; of photographs one is enough for a draft."""
STILL_DIFFERENCE = 0.004
"""Mean difference of two thumbnails in [0, 1] below which the camera did not move: above compression noise."""
RIVAL_RATIO = 1.5
"""A face this much more prominent than the one followed takes its place."""
FILMED_RATIO = 0.5
"""Ratio of the difference of neighbours to that of pictures half the sequence apart, below which it is a film."""
READING_SHARE = 0.9
"""Of the stage's time, for the progress."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write capture.frames.

    Raises Problem for a video with fewer than three readable frames, and if there is no face or no motion.
    """
    path = capture.source
    if path is None or not (path.is_dir() or path.is_file()):
        raise Problem(
            f"There is no video, photograph or folder of photographs at {str(path)!r}."
            if path
            else "No video was chosen.",
            "Choose a video of the face, a photograph, or a folder of photographs.",
        )
    photographs = path.is_dir() or is_photograph(path)
    pictures = read_source(path, settings.frames.max_frames, settings.frames.long_side, settings.frames.colour, report)
    if settings.frames.mirrored:
        pictures = (replace(picture, srgb=_flipped(picture.srgb), full=_flipped(picture.full)) for picture in pictures)
    with replacing_folder(capture.frames) as folder:
        records, thumbnails, contents, glasses = _write_frames(pictures, folder, report)
        _check(path, records, thumbnails, photographs)
        _tell_zoom(records, report)
        judge(glasses, settings.frames.no_glasses, report)
        records, contents, dropped = _drop_blurred(records, contents, folder)
        records = _even_out(records, contents, folder, report)
        shut = blinks([r.eyes_open for r in records], [r.time_s for r in records])
        records = [replace(r, blink=bool(blink)) for r, blink in zip(records, shut, strict=True)]
        photographs = photographs and not _is_filmed(records, thumbnails)
        diagnose(records, dropped, photographs, report)
        records = _select(records, settings.frames.views)
        write_frames(folder, Frames(tuple(records), PHOTOGRAPHS if photographs else VIDEO))
        report.check()
    _report(capture, records, dropped, report)


def _write_frames(pictures, folder: Path, report: Reporter) -> tuple[list[FrameRecord], np.ndarray, list, list[float]]:
    """Write all pictures; return their records, thumbnails [N, 32, 32], contents and log odds of glasses."""
    records, thumbnails, contents, glasses, details, last = [], [], [], [], [], None
    for picture in pictures:
        name = f"{picture.index:05d}.jpg"
        images.write_srgb(folder / name, picture.srgb, quality=95)
        if picture.full is not None:
            images.write_srgb(folder / FULL / name, picture.full, quality=95)
        face, rival = _subject(picture.srgb, last if picture.time_s is not None else None)
        last = face or last
        records.append(_record(picture, name, face, last, rival))
        thumbnails.append(images.resize(picture.srgb, 32, 32).mean(-1))
        contents.append(content_of(picture.srgb, picture.exposure))
        if not picture.source:
            details.append(features_of(picture.srgb))
        glasses.append(sureness(picture.srgb, face) if face else float("nan"))
        report.progress(
            READING_SHARE * picture.done, picture.of, f"frame {len(records)}, {'face found' if face else 'no face'}"
        )
    zooms = zooms_of(details) or [1.0] * len(records)
    records = [replace(record, zoom=zoom) for record, zoom in zip(records, zooms, strict=True)]
    return records, np.array(thumbnails), contents, glasses


def _tell_zoom(records: list[FrameRecord], report: Reporter) -> None:
    """Report a film whose lens changes."""
    changes = [record for before, record in zip(records, records[1:], strict=False) if before.zoom != record.zoom]
    if changes:
        zoom = max(record.zoom for record in records) / min(record.zoom for record in records)
        report.finding(
            f"The lens changes in the film, by a zoom or a switch of lenses (x {zoom:.1f}), at frame "
            f"{name_some([record.shown for record in changes])}. Each part has a camera of its own.",
            "Film with one lens, without zooming: move the camera instead.",
            [record.name for record in changes],
        )


def _flipped(picture: np.ndarray | None) -> np.ndarray | None:
    return None if picture is None else np.ascontiguousarray(picture[:, ::-1])


def _subject(srgb: np.ndarray, last: faces.Face | None) -> tuple[faces.Face | None, float]:
    """Return the subject's face and the prominence of the next face relative to it.

    The face followed so far is kept unless another one is far more prominent.
    """
    face = faces.detect(srgb, last)
    if face is None:
        return None, 0.0
    height, width = srgb.shape[:2]
    others = [(faces.prominence(each, width, height), each) for each in faces.detect_others(srgb, face)]
    if not others:
        return face, 0.0
    own = faces.prominence(face, width, height)
    second, rival = max(others, key=lambda pair: pair[0])
    return (rival, own / second) if second > RIVAL_RATIO * own else (face, second / own)


def _record(picture: Picture, name: str, face: faces.Face | None, last: faces.Face | None, rival: float) -> FrameRecord:
    """Measure a picture; `last` is where the head roughly is in a film's frame without a face."""
    near = _box_of_head(picture, face, last)
    return FrameRecord(
        name=name,
        video_frame=picture.index,
        time_s=None if picture.time_s is None else round(picture.time_s, 4),
        source=picture.source,
        size=(picture.srgb.shape[1], picture.srgb.shape[0]),
        sharpness=round(sharpness(picture.srgb, near), 5),
        selected=False,
        face_box=tuple(round(x, 1) for x in face.box) if face else None,
        face_score=round(face.score, 4) if face else 0.0,
        yaw_deg=round(face.yaw_deg, 1) if face else None,
        focal_px=picture.focal_px,
        focal_source=picture.focal.source,
        focal_deviation=picture.focal.deviation,
        focal_doubt=picture.focal.doubt,
        **examine(picture.srgb, near),
        eyes_open=tuple(round(x, 3) for x in faces.eye_openness(picture.srgb, face)) if face else None,
        other_face=round(rival, 3),
    )


def _box_of_head(picture: Picture, face: faces.Face | None, last: faces.Face | None) -> tuple | None:
    """Left, top, right and bottom of the region to measure, or None.

    The face's box; without a face the last one's in a film, the person's in a photograph.
    """
    near = face or (last if picture.time_s is not None else None)
    if near or picture.time_s is not None:
        return near.box if near else None
    y, x = np.nonzero(faces.segment_person(picture.srgb) > 0.5)
    return (x.min(), y.min(), x.max() + 1, y.max() + 1) if len(x) else None


def _drop_blurred(
    records: list[FrameRecord], contents: list, folder: Path
) -> tuple[list[FrameRecord], list, list[str]]:
    """Remove frames that are blurred compared with their neighbours, files included; return also their names."""
    bad = blurred(records)
    dropped = [r.name for r, out in zip(records, bad, strict=True) if out]
    for name in dropped:
        (folder / name).unlink()
        (folder / FULL / name).unlink(missing_ok=True)
    kept = [(r, c) for r, c, out in zip(records, contents, bad, strict=True) if not out]
    return [r for r, _ in kept], [c for _, c in kept], dropped


def _even_out(records: list[FrameRecord], contents: list, folder: Path, report: Reporter) -> list[FrameRecord]:
    """Bring all frames to the exposure and white balance of the median frame; return the records with their gains.

    Frames that have it already keep their bytes.
    """
    gains, evened = gains_of(contents, report.check), []
    for done, (record, gain) in enumerate(zip(records, gains, strict=True)):
        if np.abs(np.log(gain)).max() < 0.005:
            evened.append(record)
            continue
        report.progress(
            READING_SHARE * len(records) + (1 - READING_SHARE) * done, len(records), "evening out the exposure"
        )
        path = folder / record.name
        images.write_srgb(path, images.linear_to_srgb(images.read_linear(path) * gain.astype(np.float32)), quality=95)
        evened.append(replace(record, gain=tuple(round(float(g), 4) for g in gain)))
    return evened


def _select(records: list[FrameRecord], count: int) -> list[FrameRecord]:
    """Mark the V views. A blink is not chosen while there are other frames to choose from."""
    turn = turns(records)
    open_ = np.array([not r.blink for r in records])
    if (np.isfinite(turn) & open_).sum() >= min(count, FEWEST_FRAMES):
        turn = np.where(open_, turn, np.nan)
    chosen = set(select_views(np.array([r.sharpness for r in records]), turn, count))
    return [replace(r, selected=i in chosen) for i, r in enumerate(records)]


def _check(path: Path, records: list[FrameRecord], thumbnails: np.ndarray, photographs: bool) -> None:
    if len(records) < FEWEST_FRAMES and not photographs:
        raise Problem(
            f"Only {len(records)} frames of {path.name} could be read; a head needs at least three.",
            "Film the face for 5 to 30 seconds, walking half around it. If the file may be damaged, copy it again.",
        )
    if not any(r.face_box for r in records):
        if photographs and len(records) == 1:
            raise Problem(
                f"No face was found in {records[0].source}.",
                "Choose a photograph that shows one face from the front or half from the side, upright and well lit.",
            )
        raise Problem("No face was found in any frame.", FIND_FACE)
    if len(records) > 1 and np.abs(thumbnails - thumbnails[0]).mean((1, 2)).max() < STILL_DIFFERENCE:
        raise Problem(
            "All frames show the same picture: the camera did not move.",
            "Let the person sit still and move the camera from one ear around the face to the other.",
        )


def _is_filmed(records: list[FrameRecord], thumbnails: np.ndarray) -> bool:
    """Return whether numbered pictures are a film's frames: neighbours [N, 32, 32] are alike, unlike the others."""
    if any(record.time_s is None for record in records):
        return False
    near = np.abs(np.diff(thumbnails, axis=0)).mean((1, 2))
    far = np.abs(thumbnails - np.roll(thumbnails, len(thumbnails) // 2, axis=0)).mean((1, 2))
    return bool(np.median(near) < FILMED_RATIO * np.median(far))


def _report(capture: Capture, records: list[FrameRecord], dropped: list[str], report: Reporter) -> None:
    with_face = [r for r in records if r.face_box]
    yaws = [r.yaw_deg for r in with_face]
    gains = np.array([r.gain for r in records])
    report.figure("frames", len(records))
    report.figure("frames_dropped_as_blurred", len(dropped))
    report.figure("frames_with_a_blink", sum(r.blink for r in records))
    report.figure("views_selected", sum(r.selected for r in records))
    report.figure("share_with_face", round(len(with_face) / len(records), 3))
    report.figure("median_sharpness", round(float(np.median([r.sharpness for r in with_face])), 4))
    report.figure("median_blur", round(float(np.median([r.blur for r in with_face])), 3))
    report.figure("face_width_px", round(float(np.median([r.face_box[2] - r.face_box[0] for r in with_face]))))
    report.figure("exposure_drift_percent", round(100 * float((gains.max(0) / gains.min(0)).max() - 1), 1))
    report.figure("yaw_from_deg", min(yaws))
    report.figure("yaw_to_deg", max(yaws))
    if len(records) < FEW_FRAMES:
        report.figure("expected_quality", "rough: few frames")
    chosen = [images.read_srgb(capture.frames / r.name) for r in records if r.selected]
    images.write_srgb(capture.picture("frames", "selected"), _contact_sheet(chosen))


def _contact_sheet(pictures: list[np.ndarray], columns: int = 8, width: int = 160) -> np.ndarray:
    height = max(round(width * p.shape[0] / p.shape[1]) for p in pictures)
    columns = min(columns, len(pictures))
    sheet = np.ones((-(-len(pictures) // columns) * height, columns * width, 3), np.float32)
    for i, picture in enumerate(pictures):
        small = images.resize(picture, width, round(width * picture.shape[0] / picture.shape[1]))
        y, x = i // columns * height, i % columns * width
        sheet[y : y + small.shape[0], x : x + width] = small
    return sheet

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage frames: a video or a folder of photographs becomes frames/, with the sharpness and the turn of the head in each.

frames.json: {"kind": "video" or "photographs", "frames": [{name, video_frame, time_s, source, sharpness, selected,
face_box (px) or null, face_score, yaw_deg or null, focal_px or null}]}. Pixels are those of the written frame.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .. import faces, images
from ..capture import Capture, replacing_folder, write_json
from ..messages import Problem, Reporter
from ..settings import Settings
from .photographs import read_photographs
from .select import select_views, sharpness, turns
from .source import Picture
from .video import read_video

FEWEST = 3
FEW = 12
"""Below this many frames the result is accepted but the report warns."""
STILL = 0.004
"""Mean difference of two small frames, in [0, 1], below which the camera has not moved: above compression noise, far below a step aside."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Writes capture.frames. Raises Problem where there are fewer than three readable frames, no face, or no motion."""
    source = capture.read()["source"]
    path = Path(source)
    if not source or not path.exists():
        raise Problem(f"There is no video or folder of photographs at {source!r}." if source else "No video was chosen.",
                      "Choose a video of the face, or a folder of photographs.")
    photographs = path.is_dir()
    read = read_photographs if photographs else read_video
    pictures = read(path, settings.frames.max_frames, settings.frames.long_side, report)
    with replacing_folder(capture.frames) as folder:
        records, thumbnails = _write_frames(pictures, folder, report)
        _check(records, thumbnails, photographs)
        turn = turns(records)
        for record in records:
            record["selected"] = False
        for index in select_views(np.array([r["sharpness"] for r in records]), turn, settings.frames.views):
            records[index]["selected"] = True
        write_json(folder / "frames.json", {"kind": "photographs" if photographs else "video", "frames": records})
        report.check()
    _report(capture, records, report)


def _write_frames(pictures, folder: Path, report: Reporter) -> tuple[list[dict], np.ndarray]:
    """Consumes the pictures; their records and thumbnails [N, 32, 32]."""
    records, thumbnails, last = [], [], None
    for picture in pictures:
        name = f"{picture.index:05d}.jpg"
        images.write_srgb(folder / name, picture.srgb, quality=95)
        last = face = faces.detect(picture.srgb, last)
        records.append(_record(picture, name, face))
        thumbnails.append(images.resize(picture.srgb.mean(-1), 32, 32))
        report.progress(picture.done, picture.of, f"frame {len(records)}, {'face found' if face else 'no face'}")
    return records, np.array(thumbnails)


def _record(picture: Picture, name: str, face: faces.Face | None) -> dict:
    return {
        "name": name, "video_frame": picture.index, "time_s": None if picture.time_s is None else round(picture.time_s, 4), "source": picture.source,
        "sharpness": round(sharpness(picture.srgb, face.box if face else None), 5), "selected": False,
        "face_box": [round(x, 1) for x in face.box] if face else None, "face_score": round(face.score, 4) if face else 0.0,
        "yaw_deg": round(face.yaw_deg, 1) if face else None, "focal_px": picture.focal_px,
    }


def _check(records: list[dict], thumbnails: np.ndarray, photographs: bool) -> None:
    if len(records) < FEWEST:
        what, remedy = ("photographs", "Take 30 or more photographs around the face.") if photographs else (
            "frames", "Film the face for 5 to 30 seconds while you walk half around it; a damaged file may be whole once copied again.")
        raise Problem(f"Only {len(records)} {what} could be read; three are the least a head can be built from.", remedy)
    if not any(r["face_box"] for r in records):
        raise Problem("No face was found in any frame.",
                      "Film one face, upright, filling a third of the picture or more, and lit well enough to see the eyes.")
    if np.abs(thumbnails - thumbnails[0]).mean((1, 2)).max() < STILL:
        raise Problem("All frames show the same picture: the camera did not move.",
                      "Let the person sit still and move the camera from one ear around the face to the other.")


def _report(capture: Capture, records: list[dict], report: Reporter) -> None:
    found = [r for r in records if r["face_box"]]
    yaws = [r["yaw_deg"] for r in found]
    report.figure("frames", len(records))
    report.figure("views_selected", sum(r["selected"] for r in records))
    report.figure("share_with_face", round(len(found) / len(records), 3))
    report.figure("median_sharpness", round(float(np.median([r["sharpness"] for r in found])), 4))
    report.figure("yaw_from_deg", min(yaws))
    report.figure("yaw_to_deg", max(yaws))
    if len(records) < FEW:
        report.figure("expected_quality", "rough: few frames")
        report.log(f"Only {len(records)} frames: expect a rough head with holes at the sides and a texture from few directions. "
                   "60 or more frames around the face give a full one.")
    chosen = [images.read_srgb(capture.frames / r["name"]) for r in records if r["selected"]]
    images.write_srgb(capture.picture("frames", "selected"), _contact_sheet(chosen))


def _contact_sheet(pictures: list[np.ndarray], columns: int = 8, width: int = 160) -> np.ndarray:
    height = max(round(width * p.shape[0] / p.shape[1]) for p in pictures)
    columns = min(columns, len(pictures))
    sheet = np.ones((-(-len(pictures) // columns) * height, columns * width, 3), np.float32)
    for i, picture in enumerate(pictures):
        small = images.resize(picture, width, round(width * picture.shape[0] / picture.shape[1]))
        y, x = i // columns * height, i % columns * width
        sheet[y:y + small.shape[0], x:x + width] = small
    return sheet

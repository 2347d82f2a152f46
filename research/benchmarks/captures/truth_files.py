# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of a rendered capture's truth, in the layout that research/benchmarks/maps/albedo_score.py reads."""

from pathlib import Path

import numpy as np

from core.capture.files import replacing, write_json
from core.imaging import images

from ...people import scene
from ...people.skin import Skin

TRUTHS = 14  # frames whose truth is written
BALANCED = 0.75  # share of the light's colour that the white balance takes out
# percentile of the brightest channel on the face that the exposure brings to this linear level
WHITE_AT, TO = 99.0, 0.8
Faces = dict[int, tuple[np.ndarray, np.ndarray]]
"""Frame with truth -> its linear albedo [H, W, 3] and facial skin, bool [H, W]."""


def true_frames(count: int) -> list[int]:
    """Return the frames, of `count`, whose truth is written."""
    return np.unique(np.linspace(1, count - 2, TRUTHS).round().astype(int)).tolist()


def write_cameras(
    target: Path, light: str, cameras: np.ndarray, scale: float, poses: np.ndarray | None = None, **more
) -> None:
    """Write cameras.json: the light in words, camera-to-world matrices [N, 4, 4], and the head's poses if it sways."""
    size = {"focal_px": scene.FOCAL * scale, "width": round(scene.WIDTH * scale), "height": round(scene.HEIGHT * scale)}
    entries = [{"frame": k, "matrix_world": matrix.tolist()} for k, matrix in enumerate(cameras)]
    for entry, pose in zip(entries, () if poses is None else poses, strict=False):
        entry["head_pose"] = pose.tolist()
    about = {"name": target.name, "light": light, **size, **more}
    write_json(target / "cameras.json", {**about, "cameras": entries})


def write_frame(target: Path, frame: int, albedo: np.ndarray, alpha: np.ndarray, **masks: np.ndarray | None) -> None:
    """Write a frame's linear albedo [H, W, 3] with alpha [H, W], and masks [H, W] in folders of their names."""
    name = f"{frame:04d}.png"
    images.write_srgb(target / "albedo" / name, np.concatenate([images.linear_to_srgb(albedo), alpha[..., None]], -1))
    for folder, mask in masks.items():
        if mask is not None:
            images.write_data(target / folder / name, mask.astype(np.float32))


def write_maps(folder: Path, skin: Skin) -> None:
    """Write a subject's true maps under the solved maps' names and in their encoding."""
    images.write_srgb(folder / "diffuse_albedo.png", images.linear_to_srgb(skin.diffuse), bits=16)
    images.write_data(folder / "specular_albedo.png", skin.specular, bits=16)
    images.write_data(folder / "normal.png", skin.normal / 2 + 0.5, bits=16)


def write_tone(target: Path, faces: Faces) -> None:
    """Write skin_tone.txt, the mean albedo of the facial skin; it is written last, as the sign that all is there."""
    total = sum(albedo[face].sum(0, dtype=np.float64) for albedo, face in faces.values())
    mean = images.linear_to_srgb(total / sum(int(face.sum()) for _, face in faces.values()))
    with replacing(target / "skin_tone.txt") as temporary:
        temporary.write_text(",".join(f"{c:.4f}" for c in mean) + "\n", encoding="ascii")


def exposure(work: Path, faces: Faces) -> np.ndarray:
    """Return one gain [3] for all rendered frames work/NNNNN.exr, as a phone meters faces.

    BALANCED of the light's colour goes, and the WHITE_AT percentile of the face comes to TO.
    """
    lit = np.concatenate([images.read_linear(work / f"{k:05d}.exr")[face] for k, (_, face) in faces.items()])
    cast = lit.mean(0) / np.concatenate([albedo[face] for albedo, face in faces.values()]).mean(0)
    gain = (cast / cast.mean()) ** -BALANCED
    return gain * TO / np.percentile((lit * gain).max(1), WHITE_AT)

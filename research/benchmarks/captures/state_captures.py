# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures that research/benchmarks/delighting/state.py measures, as maps in the UVs of their heads.

A folder holds NAME.wildcap and beside it, or in another folder, NAME/ with the truth
(research/benchmarks/maps/albedo_score.py says its layout; head.obj, the true head, tells which captures show the same
person; maps/part_NAME.png are masks in the head's UVs, where there are any).
"""

import argparse
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from core.capture.capture import Capture
from core.capture.hashes import hash_file
from core.face import template
from core.face.head import Head, read_head
from core.geometry.raster import interpolate
from core.imaging import images
from core.settings.settings import Settings

from ..measures.features_kept import BARE
from ..measures.references import BLUR, FLAT, NOTHING, TRUE, blur_divided_out, flat_colour
from .controlled_captures import use_true_frames

SIZE = 512
"""Side of the maps on which measures in UV space are taken: a texel is about half a millimetre."""
SEEN = 0.3
"""Least confidence of a texture, of the delit and of the true frames', at texels that count."""
DELIT, SOLVED = "delit texture", "solved"
METHODS = (NOTHING, FLAT, BLUR, TRUE, DELIT, SOLVED)
PARTS = ("skin", "brows", "lips", "eyes")


@dataclass(frozen=True)
class Filmed:
    """One capture with its truth.

    person: the first name, in order, of the truths with the same head; work: folder for what is made of it.
    """

    name: str
    person: str
    capture: Capture
    truth: Path
    work: Path

    @cached_property
    def head(self) -> Head:
        return read_head(self.capture)

    @cached_property
    def true_capture(self) -> Capture:
        """Return a copy whose delit frames are the true albedo, up to its texture.

        Made once, and again if the head or the cameras changed.
        """
        copy = Capture(self.work / f"{self.name}.wildcap")
        same = ("head.obj", "cameras/cameras.bin", "cameras/images.bin")
        changed = copy.texture_confidence.is_file() and any(
            hash_file(copy.root / name) != hash_file(self.capture.root / name) for name in same
        )
        if changed:
            copy.texture_confidence.unlink()
        return use_true_frames(self.capture, self.truth, copy, Settings())

    def inputs(self) -> list[Path]:
        """Return the files that the figures of this capture depend on, without the truth's pictures."""
        capture = self.capture
        maps = capture.texture_filmed, capture.texture, capture.texture_confidence, capture.maps / "diffuse_albedo.png"
        paths = capture.head, *maps, self.truth / "cameras.json", self.truth / "head.obj"
        return [path for path in paths if path.is_file()]

    @cached_property
    def truth_map(self) -> np.ndarray:
        """Return the texture of the true albedo frames, linear [S, S, 3] at its own size."""
        return images.read_linear(self.true_capture.texture)

    @cached_property
    def where(self) -> np.ndarray:
        """Return the texels of the face that the capture and its true frames saw well, bool [SIZE, SIZE].

        A person's own eyes and lashes are left out: the true frames have them painted on the lids, where an answer has
        lids that were completed from around.
        """
        confident = [
            images.resize(images.read_data(capture.texture_confidence)[..., 0], SIZE, SIZE) > SEEN
            for capture in (self.capture, self.true_capture)
        ]
        face = (template.mask("face", SIZE) > 0.5) & confident[0] & confident[1]
        eyes = self.own_parts().get("eyes")
        if eyes is None:
            return face
        reach = 2 * round(BARE * np.ptp(landmarks_in_uv()[:, 0])) + 1
        return face & ~(cv2.dilate(eyes.astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0)

    def answer(self, method: str) -> np.ndarray | None:
        """Return what a method takes for the albedo, linear [S, S, 3]; None where the capture was not taken so far."""
        if method == TRUE:
            return self.truth_map
        paths = {DELIT: self.capture.texture, SOLVED: self.capture.maps / "diffuse_albedo.png"}
        path = paths.get(method, self.capture.texture_filmed)
        if not path.is_file():
            return None
        answer = images.read_linear(path)
        if method in (FLAT, BLUR):
            where = images.resize(self.where.astype(np.float32), len(answer), len(answer)) > 0.5
            return (flat_colour if method == FLAT else blur_divided_out)(answer, where)
        return answer

    @cached_property
    def normals(self) -> np.ndarray:
        """Return unit normals [SIZE, SIZE, 3] in the axes of the built-in head; zero off the head."""
        unfolded = self.head.unfold(SIZE)
        return unfolded.spread(unfolded.normals @ rotation_between(self.head.mesh.vertices, template.load().vertices).T)

    def parts(self) -> dict[str, np.ndarray]:
        """Return part -> bool [SIZE, SIZE], the truth's own masks before the built-in head's; skin is the rest."""
        found = {name: _dense(template.mask(name, SIZE)) for name in PARTS} | self.own_parts()
        others = np.logical_or.reduce([mask for name, mask in found.items() if name != "skin"])
        return {**found, "skin": found["skin"] & ~others}

    def own_parts(self) -> dict[str, np.ndarray]:
        """Return part -> bool [SIZE, SIZE] of the truth's own masks."""
        return {
            path.stem.removeprefix("part_"): _dense(images.read_mask(path))
            for path in sorted((self.truth / "maps").glob("part_*.png"))
        }


def _dense(mask: np.ndarray) -> np.ndarray:
    """Return the texels where a mask is at least half as dense as its maximum, bool [SIZE, SIZE]."""
    soft = images.resize(mask, SIZE, SIZE)
    return soft > 0.5 * max(float(soft.max()), 1e-3)


def find(folder: Path, truths: Path, work: Path) -> list[Filmed]:
    """Return the captures of a folder that have a texture and a truth, by name.

    The truths tell who a person is, so the name stays when another capture is finished later.
    """
    first: dict[str, str] = {}
    for truth in sorted(path.parent for path in truths.glob("*/albedo") if path.is_dir()):
        first.setdefault(_true_head(truth), truth.name)
    captures = [Capture(path) for path in sorted(folder.glob("*.wildcap"))]
    pairs = [(capture, truths / capture.root.stem) for capture in captures if capture.texture.is_file()]
    return [
        Filmed(truth.name, first[_true_head(truth)], capture, truth, work)
        for capture, truth in pairs
        if (truth / "albedo").is_dir()
    ]


def add_captures(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that name captures with a truth."""
    parser.add_argument("folder", type=Path)
    parser.add_argument("--truths", type=Path, help="where NAME/ with the truth lies, if not in FOLDER")
    parser.add_argument("--only", nargs="+", default=[""], help="captures whose names begin so")


def captures_asked(parser: argparse.ArgumentParser, options: argparse.Namespace) -> list[Filmed]:
    """Return the captures that these arguments name; end with an error if there are none."""
    found = chosen_captures(options)
    if not found:
        parser.error(f"{options.folder} holds no capture with a texture and a truth.")
    return found


def chosen_captures(options: argparse.Namespace) -> list[Filmed]:
    """Return the captures that the arguments of `add_captures` name."""
    folder = options.folder.resolve()
    captures = find(folder, (options.truths or folder).resolve(), folder / "state")
    return [filmed for filmed in captures if filmed.name.startswith(tuple(options.only))]


def landmarks_in_uv(size: int = SIZE) -> np.ndarray:
    """Return the 468 landmarks on a map of the built-in head, [468, 2] in texels."""
    mesh, (face, bary) = template.load(), template.landmarks()
    uv = interpolate(mesh.uvs, mesh.face_uvs, face, bary)
    return np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * size


def rotation_between(points: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return the rotation [3, 3] that brings points [N, 3] nearest to targets [N, 3] (Kabsch 1976)."""
    u, _, vt = np.linalg.svd((points - points.mean(0)).T @ (targets - targets.mean(0)))
    return vt.T @ np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T


def _true_head(truth: Path) -> str:
    """Return what tells two people apart: the true head, or the truth itself where it has none."""
    return hash_file(truth / "head.obj") if (truth / "head.obj").is_file() else str(truth)

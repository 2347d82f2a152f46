# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heads that research/benchmarks/light/relit.py renders: captures of one head with the maps of each row.

All rows share the registered head, so that pixels can be compared. It wears the true maps where its surface lies on the
true head, not where their UVs agree: these are a millimetre apart, by which all fine detail would count as an error.
All albedos have the same mean over confident facial skin, the truth's: what the rows differ in is not brightness.
"""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from core import __version__
from core.capture import stages
from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.newest_maps import find_newest_maps
from core.face import template
from core.face.head import read_head
from core.geometry.baking import Source, bake, bake_normals, places
from core.geometry.meshes import Mesh
from core.imaging import images
from core.settings.settings import Settings
from core.stages.upscale.gloss import on_cheeks_and_forehead

SIZE = 1024
"""Texels of every row's maps; what is delivered at 4096 is averaged to it, for a texel is smaller than a pixel of the
pictures as it is."""
FARTHEST_M = 0.01
"""Between the registered head and the true one, beyond which they do not show the same place."""


@dataclass(frozen=True)
class Worn:
    """Maps, float32 on S x S texels.

    albedo [S, S, 3]: linear; normal [S, S, 3]: unit, tangent space, OpenGL Y+; specular [S, S]: Specular IOR Level.
    """

    albedo: np.ndarray
    normal: np.ndarray
    specular: np.ndarray


def make_rows(raw: np.ndarray, delit: np.ndarray, solved: Worn, true: Worn, skin: np.ndarray) -> dict[str, Worn]:
    """Return the table's rows, whose albedos share one mean.

    raw, delit: textures, linear [S, S, 3]; skin: [S, S], weight of the texels of that mean. Returns name -> maps."""
    even = np.full_like(solved.specular, (solved.specular * skin).sum() / skin.sum())
    flat = np.broadcast_to(np.float32([0, 0, 1]), solved.normal.shape)
    tone = (true.albedo * skin[..., None]).sum((0, 1)) / skin.sum()
    solved = replace(solved, albedo=toned(solved.albedo, tone, skin))
    return {
        "truth": true,
        "raw": replace(solved, albedo=toned(raw, tone, skin)),
        "delit": replace(solved, albedo=toned(delit, tone, skin)),
        "solved": solved,
        "plain": replace(solved, normal=flat, specular=even),
        "no_relief": replace(solved, normal=flat),
        "even_gloss": replace(solved, specular=even),
        "true_albedo": replace(solved, albedo=true.albedo),
        "true_normal": replace(solved, normal=true.normal),
        "true_specular": replace(solved, specular=true.specular),
        "floor": true,
    }


def toned(texture: np.ndarray, tone: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Return a texture [S, S, 3] with the gain per channel that gives it the mean `tone` [3] over `skin` [S, S]."""
    return np.clip(texture * (tone * skin.sum() / (texture * skin[..., None]).sum((0, 1))), 0, 1).astype(np.float32)


def read_worn(folder: Path, size: int = SIZE) -> Worn:
    """Return a folder of maps, averaged to `size`."""
    normal = _sized(images.read_data(folder / "normal.png")[..., :3] * 2 - 1, size)
    return Worn(
        _sized(images.read_linear(folder / "diffuse_albedo.png"), size),
        normal / np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-6),
        _sized(images.read_mask(folder / "specular_albedo.png"), size),
    )


def worn_by(capture: Capture, true: Worn, subject: Mesh) -> Worn:
    """Return the true maps on the capture's head: each texel takes the nearest on the subject within FARTHEST_M.

    subject: in the capture's world, in metres.
    """
    at = places(read_head(capture).mesh, (0, 0), Source(subject), len(true.specular), FARTHEST_M, lambda share: None)

    def carried(baked: np.ndarray, own: np.ndarray) -> np.ndarray:
        known = at.known.reshape(at.known.shape + (1,) * (own.ndim - 2))
        return np.where(known, baked.reshape(own.shape), own).astype(np.float32)

    normal = carried(bake_normals(true.normal / 2 + 0.5, at) * 2 - 1, true.normal)
    return Worn(carried(bake(true.albedo, at), true.albedo), normal, carried(bake(true.specular, at), true.specular))


def read_rows(capture: Capture, true: Worn) -> dict[str, Worn]:
    """Return `make_rows` of a solved capture and its true maps, at 4K where the solved ones were enlarged."""
    newest = find_newest_maps(capture)[0].parent
    confidence = _sized(images.read_data(capture.texture_confidence)[..., 0], SIZE)
    raw, delit = (_sized(images.read_linear(path), SIZE) for path in (capture.texture_filmed, capture.texture))
    return make_rows(raw, delit, read_worn(newest), true, confidence * template.mask("skin", SIZE))


def write_row(folder: Path, capture: Capture, worn: Worn) -> None:
    """Write a capture with another one's head and record and these maps, for the add-on to open as solved."""
    row, record = Capture(folder), capture.read()
    confidence = _sized(images.read_data(capture.texture_confidence)[..., 0], len(worn.specular))
    figures = record["stages"].get("upscale", {}).get("figures", {})
    figures |= {"specular_mean": on_cheeks_and_forehead(worn.specular, confidence)}
    shutil.rmtree(folder, ignore_errors=True)
    row.maps.mkdir(parents=True)
    shutil.copyfile(capture.head, row.head)
    write_json(row.json, record)
    row.finish(stages.by_name("upscale"), {"inputs": {}, "code": ""}, 0.0, Settings(), figures, __version__)
    images.write_srgb(row.maps / "diffuse_albedo.png", images.linear_to_srgb(worn.albedo), bits=16)
    images.write_data(row.maps / "specular_albedo.png", worn.specular, bits=16)
    images.write_data(row.maps / "normal.png", worn.normal / 2 + 0.5, bits=16)


def face_mask(path: Path) -> None:
    """Write the picture that tells face from head: red facial skin and lips, green everywhere."""
    face = template.mask("face", SIZE)
    images.write_data(path, np.stack([face, np.ones_like(face), np.zeros_like(face)], -1))


def _sized(image: np.ndarray, size: int) -> np.ndarray:
    return image if image.shape[:2] == (size, size) else images.resize(image, size, size)

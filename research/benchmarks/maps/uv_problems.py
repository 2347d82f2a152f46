# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""UV-space problems with known truth: subjects that no training saw, lit not quite as the paper assumes.

texture = albedo * (global SH + the rest) * shadow, blurred by a texel, with noise. The global SH are fitted to a sky
with its occlusion and a sun; the rest is what they cannot explain, scaled to 10 % of the light; shadow is what cast
shadows leave of it, per channel. Of kind "delit" the shading is nearly flat already, 30 to 60 % of each shadow is left
and the colour is off by a few percent over large regions, as a delighter leaves its frames.
"""

import hashlib
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import torch
import trimesh

from core.capture.capture import Capture
from core.capture.files import replacing
from core.capture.messages import Reporter
from core.face import template
from core.geometry import meshes
from core.imaging import images
from core.solver.lighting import fit_global, shading_basis
from core.stages.solve.skin_tone import GIVEN, SkinTone

from ...people import light
from ...people.light import bake, random_light
from ...people.parameters import sample_parameters
from ...people.skin import make_skin
from ...training.carry import carry
from ..figures import SHARED

SHADOWS = {"leaves, hard": ("leaves", 0.005), "edge, half soft": ("edge", 0.012), "blinds, soft": ("blinds", 0.025)}
"""Name -> (what throws it, angular radius of the sun in radians). The head's own shadow (nose, brow, chin) falls on
every problem."""
MASKED = 0.12, 0.5
"""Share of the face that the mask covers: lights that leave more or less are drawn again, as are those that leave lit
skin nearly black."""
UNEXPLAINED = 0.10  # of the light, root mean square: what second-order SH cannot explain
NOISE = 0.004  # deviation, linear
LEE_PERRY_SMITH = SHARED / "lee_perry_smith"
CACHE = Path(tempfile.gettempdir()) / "wildcap_ablation"


@dataclass(frozen=True)
class MaskedUvProblem:
    """A problem, float32, linear.

    albedo, texture [S, S, 3]; shadow [S, S]: the blocked share of the sun; mask [S, S]: M as an artist would paint it,
    a bit too large.
    """

    albedo: np.ndarray
    texture: np.ndarray
    shadow: np.ndarray
    mask: np.ndarray

    @property
    def face(self) -> np.ndarray:
        """Return the texels of the face, bool [S, S]."""
        return template.mask("face", len(self.albedo)) > 0.5

    @property
    def tone(self) -> SkinTone:
        """Return the true skin's tone, eyes left out."""
        skin = skin_weight(len(self.albedo))
        return SkinTone.from_linear((self.albedo * skin[..., None]).sum((0, 1)) / skin.sum(), GIVEN)

    def write(self, capture: Capture) -> None:
        """Write the solver's inputs of a capture: a texture that was seen all over, the mask, the built-in head."""
        images.write_linear(capture.texture, self.texture)
        images.write_data(capture.texture_confidence, np.ones(self.shadow.shape, np.float32))
        images.write_data(capture.shadow_mask_auto, self.mask)
        meshes.write_obj(capture.head, template.load())

    def regions(self) -> dict[str, np.ndarray]:
        """Return name -> bool [S, S]: shadow, a band of 12 texels (of 1024) at its border, and outside."""
        edge = cv2.morphologyEx((self.shadow > 0.5).astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
        band = cv2.dilate(edge, np.ones((25 * len(self.albedo) // 1024 | 1,) * 2, np.uint8)) > 0
        return {
            "shadow": self.face & (self.shadow > 0.5) & ~band,
            "band": self.face & band,
            "outside": self.face & (self.shadow < 0.05) & ~band,
        }


def make_problem(subject: str, shadows: str, size: int, kind: str = "raw") -> MaskedUvProblem:
    """Return a problem; the same arguments give the same one.

    subject: a seed of research/people, "lee_perry_smith", or the path of a skin in our UVs (sRGB); kind: "raw", or
    "delit", with little of the light left."""
    albedo = albedo_of(subject, size)
    seeds = tuple(hashlib.blake2b(f"{Path(subject).stem} {shadows}".encode(), digest_size=8).digest())
    shading, kept, shadow = _chosen_light(shadows, seeds, size)
    face, rng = template.mask("face", size) > 0.5, np.random.default_rng(seeds)
    if kind == "delit":
        shading = shading[face].mean(0) * (shading / shading[face].mean(0)) ** 0.15 * np.exp(0.06 * _slow(rng, size))
        kept = 1 - rng.uniform(0.3, 0.6) * (1 - kept)
    lit = albedo * shading * kept
    lit *= 0.8 / np.percentile(lit[face].max(-1), 99.5)
    filmed = cv2.GaussianBlur(lit, (3, 3), 0.5) + rng.normal(0, NOISE, lit.shape)
    return MaskedUvProblem(albedo, np.maximum(filmed, 0).astype(np.float32), shadow, _painted(shadow))


def skin_weight(size: int) -> np.ndarray:
    """Return the weight of the skin in [0, 1], [S, S], eyes left out."""
    return template.mask("skin", size) * (1 - template.mask("eyes", size))


def albedo_of(subject: str, size: int) -> np.ndarray:
    """Return a linear albedo [S, S, 3]; light that is painted into real skins counts as theirs."""
    if subject.isdigit():
        return make_skin(sample_parameters(int(subject)), size).diffuse
    path = lee_perry_smith() if subject == LEE_PERRY_SMITH.name else Path(subject)
    return np.clip(images.resize(images.read_linear(path), size, size), 0.004, 1)


def lee_perry_smith() -> Path:
    """Return the scan's colour map in our UVs, carried once and kept outside of this repository (CC BY)."""
    out = CACHE / "lee_perry_smith"
    if not (out / "carried.json").is_file():
        scan = trimesh.load(LEE_PERRY_SMITH / "LeePerrySmith.glb").geometry["LeePerrySmith"]
        # this file's v grows downwards, against the glTF reader's reading
        uvs = np.asarray(scan.visual.uv) * [1, -1] + [0, 1]
        folder = CACHE / "lee_perry_smith_source"
        folder.mkdir(parents=True, exist_ok=True)
        meshes.write_obj(
            folder / "head.obj",
            meshes.Mesh(np.asarray(scan.vertices), np.asarray(scan.faces), uvs, np.asarray(scan.faces)),
        )
        with replacing(folder / f"{LEE_PERRY_SMITH.name}.jpg") as temporary:
            temporary.write_bytes((LEE_PERRY_SMITH / "Map-COL.jpg").read_bytes())
        carry(folder, out, folder / "head.obj", 1024, Reporter("carry"))
    return out / f"{LEE_PERRY_SMITH.name}.png"


def _chosen_light(shadows: str, seeds: tuple[int, ...], size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the first usable random light, kept in CACHE under a key of the sources it comes from."""
    sources = b"".join(Path(module).read_bytes() for module in (__file__, light.__file__))
    key = hashlib.blake2b(repr((shadows, seeds, size)).encode() + sources, digest_size=12).hexdigest()
    stored = CACHE / f"light_{key}.npz"
    if not stored.is_file():
        drawn = next(i for i in range(1000) if _usable(*_light(shadows, (*seeds, i), 48)))
        CACHE.mkdir(parents=True, exist_ok=True)
        with replacing(stored) as temporary, open(temporary, "wb") as file:
            np.savez_compressed(file, *_light(shadows, (*seeds, drawn), size))
    with np.load(stored) as file:
        return file["arr_0"], file["arr_1"], file["arr_2"]


def _light(shadows: str, seeds: tuple[int, ...], size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return shading without cast shadows [S, S, 3], the share that these leave [S, S, 3], and the shadow [S, S]."""
    thrown_by, radius = SHADOWS[shadows]
    rng = np.random.default_rng(seeds)
    drawn = replace(random_light(rng), radius=radius)
    lit, shadow, normal = bake(template.load(), size, drawn, thrown_by, rng)
    open_light, _, _ = bake(template.load(), size, drawn, "none", rng)
    face = template.mask("face", size) > 0.5
    even = _sh_part(open_light, normal, face)
    rest = open_light - even
    rest *= UNEXPLAINED * even[face].mean() / np.sqrt((rest[face] ** 2).mean())
    opened = np.clip(lit / np.maximum(open_light, 1e-4), 0.05, 1)
    return np.maximum(even + rest, 0.05 * even[face].mean()), opened, shadow


def _usable(shading: np.ndarray, kept: np.ndarray, shadow: np.ndarray) -> bool:
    face = template.mask("face", len(shadow)) > 0.5
    lightness = shading[face].mean(-1)
    dark = kept[face & (shadow > 0.5)]
    return (
        MASKED[0] < _painted(shadow)[face].mean() < MASKED[1]
        and (shadow[face] > 0.5).mean() > MASKED[0] / 2
        and 0.2 < dark.mean() < 0.75
        and np.percentile(lightness, 3) > 0.3 * lightness.mean()
    )


def _painted(shadow: np.ndarray) -> np.ndarray:
    """Return the mask an artist would paint over a shadow: all of it and a little more."""
    return cv2.dilate((shadow > 0.08).astype(np.uint8), np.ones((9 * len(shadow) // 1024 | 1,) * 2, np.uint8)).astype(
        np.float32
    )


def _sh_part(shading: np.ndarray, normal: np.ndarray, face: np.ndarray) -> np.ndarray:
    """Return the second-order SH of the normals that are nearest to a shading on the face, [S, S, 3]."""
    basis = shading_basis(torch.from_numpy(np.ascontiguousarray(normal.transpose(2, 0, 1), np.float32)))
    target = torch.from_numpy(np.ascontiguousarray(shading.transpose(2, 0, 1), np.float32))
    gamma = fit_global(target, torch.ones_like(target), basis, torch.from_numpy(face.astype(np.float32)), ridge=1e-4)
    fitted = torch.einsum("ck,khw->hwc", gamma, basis).numpy()
    return np.maximum(fitted, 0.02 * fitted[face].mean())


def _slow(rng: np.random.Generator, size: int) -> np.ndarray:
    """Return fields of deviation one that vary over about a sixth of the map, mostly in lightness, [S, S, 3]."""
    shared, own = rng.normal(size=(7, 7, 1)), rng.normal(size=(7, 7, 3))
    field = cv2.resize(0.8 * shared + 0.6 * own, (size, size), interpolation=cv2.INTER_CUBIC)
    return (field / field.std()).astype(np.float32)

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The maps of a delivery: channels packed, normals flipped, size, bit depth and colour space as the target wants them.

A map that the capture lacks is left out.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..capture import skin_regions
from ..capture.delivery_plan import DeliveryPlan
from ..capture.messages import Problem
from ..capture.stages import advise_remaking
from ..capture.toned_albedo import apply_tone
from ..face import template
from ..imaging import images
from ..settings.delivery_presets import COLOUR, NORMAL, MapPicture

F0 = 0.0278
"""Reflectance of skin, IOR 1.4, at normal incidence: ((1.4 - 1) / (1.4 + 1))^2. The specular map's mean stands for
it."""
UNREAL_F0 = 0.08
"""Reflectance at normal incidence of Unreal's Specular 1."""
STRIP_ROWS = 256
"""Rows encoded at once, to save memory."""


@dataclass(frozen=True)
class Toned:
    """Linear gain [3] of the skin, and its weight [S, S] by the side S of the map that it is for."""

    gain: tuple[float, float, float]
    weight: Callable[[int], np.ndarray]

    def apply(self, albedo: np.ndarray) -> np.ndarray:
        """Return linear albedo [S, S, 3] with its skin in the chosen tone, float32; a strip at a time."""
        weight, gain = self.weight(len(albedo))[..., None], np.array(self.gain, np.float32)
        result = np.empty_like(albedo, np.float32)
        for row in range(0, len(albedo), STRIP_ROWS):
            rows = slice(row, row + STRIP_ROWS)
            result[rows] = apply_tone(albedo[rows], weight[rows], gain)
        return result


class Sources:
    """Maps of one UV tile, read on demand, at one size.

    `paths`: albedo, normal, specular, clean, lit ... -> file. `roughness` is that of the cheeks, `mean` the specular
    map's on facial skin, `unit` in metres. `regions`: the UVs are those of the built-in head, whose other regions are
    known. `toned`: what follows a skin tone that was chosen after the solve, by the same names.
    """

    def __init__(
        self,
        paths: dict[str, Path],
        size: int,
        roughness: float,
        mean: float,
        unit: float = 1.0,
        regions: bool = False,
        toned: dict[str, Toned] | None = None,
    ):
        self.paths, self.roughness, self.mean, self.unit, self.regions = paths, roughness, mean, unit, regions
        self.toned = toned or {}
        stored = [images.size(path)[0] for name, path in paths.items() if name in ("albedo", "normal")]
        self.size = min([size, *stored])
        self._read: dict[str, np.ndarray] = {}

    def has(self, picture: MapPicture) -> bool:
        """Return whether all files for the picture's channels exist; roughness needs none."""
        return {_file_of(term) for term in picture.channels} - {"roughness", ""} <= set(self.paths)

    def channel(self, term: str) -> np.ndarray:
        """Return one channel, float32 [S, S].

        albedo, clean and lit are linear, x, y, z of the normal in [-1, 1], the rest as stored.
        """
        name, _, component = term.partition(".")
        if component:
            return self._file(name)[..., "rgbxyz".index(component) % 3]
        if term in ("0", "1"):
            return np.full((self.size, self.size), float(term), np.float32)
        if term in ("roughness", "smoothness"):
            rough = np.full((self.size, self.size), self.roughness, np.float32)
            # as the node group WildCap Skin has it
            rough = np.clip(rough * (1 + _shares(self.size)), 0, 1) if self.regions else rough
            return rough if term == "roughness" else 1 - rough
        if term in ("level", "weight", "f0", "unreal_specular"):
            # as the node group WildCap Skin has it
            level = np.clip(0.5 * self._file("specular") / max(self.mean, 1e-6), 0, 1)
            scale = {"level": 1.0, "weight": 2.0, "f0": 2 * F0, "unreal_specular": 2 * F0 / UNREAL_F0}[term]
            return (level * scale).astype(np.float32)
        pixels = self._file(term)
        return pixels / self.unit if term == "displacement" else pixels

    def check(self, name: str) -> None:
        """Raise Problem for a file that is damaged, or not square."""
        self._file(name)

    def _file(self, name: str) -> np.ndarray:
        if name not in self._read:
            linear = dict.fromkeys(("albedo", "clean", "lit"), images.read_linear)
            read = {**linear, "normal": images.read_normals}.get(name, images.read_mask)
            pixels = _square(self.paths[name], read(self.paths[name]))
            if name in self.toned:
                pixels = self.toned[name].apply(pixels)
            self._read[name] = _sized(pixels, self.size, name == "normal")
        return self._read[name]


def write(picture: MapPicture, sources: Sources, path: Path, plan: DeliveryPlan) -> None:
    """Write one file of the set from the maps of its UV tile, which must exist (Sources.has)."""
    bits = {"png8": 8, "png16": 16, "exr": 16}[plan.pictures]
    first = picture.channels[0]
    as_it_is = first.endswith((".r", ".x")) and len(picture.channels) == 3 and _file_of(first)
    if as_it_is and _stored_alike(picture, sources, plan, as_it_is):
        sources.check(as_it_is)
        shutil.copyfile(sources.paths[as_it_is], path)  # byte for byte as the stage wrote it
        return
    pixels = np.stack([sources.channel(term) for term in picture.channels], 2)
    if picture.kind == NORMAL:
        if plan.normals == "directx":
            pixels[..., 1] *= -1
        images.write_data(path, pixels * 0.5 + 0.5, bits)
        return
    if picture.kind == COLOUR and plan.colour == "srgb":
        for row in range(0, len(pixels), STRIP_ROWS):
            pixels[row : row + STRIP_ROWS, :, :3] = images.linear_to_srgb(pixels[row : row + STRIP_ROWS, :, :3])
    if pixels.shape[2] == 4:
        images.write_packed(path, pixels, bits, srgb=picture.kind == COLOUR and plan.colour == "srgb")
    elif picture.kind == COLOUR:
        images.write_linear(path, pixels) if plan.colour == "linear" else images.write_srgb(path, pixels, bits)
    else:
        images.write_data(path, pixels[..., 0] if pixels.shape[2] == 1 else pixels, bits)


def _shares(size: int) -> np.ndarray:
    """Return how much rougher than the cheeks the built-in head is, as a share, float32 [size, size]."""
    brows = np.flatnonzero(template.mask("brows", size).max(1) > 0.5).min()
    above = np.clip((brows - np.arange(size)) / (skin_regions.FOREHEAD_FADE * size), 0, 1).astype(np.float32)
    result = np.zeros((size, size), np.float32)
    for name, share in skin_regions.ROUGHNESS.items():
        mask = template.mask("face", size) * above[:, None] if name == "forehead" else template.mask(name, size)
        result += mask * (share - result)
    return result


def _file_of(term: str) -> str:
    """Return the file that a channel comes from, '' for a constant."""
    if term in ("0", "1"):
        return ""
    name = term.partition(".")[0]
    return {
        "level": "specular",
        "weight": "specular",
        "f0": "specular",
        "unreal_specular": "specular",
        "smoothness": "roughness",
    }.get(name, name)


def _stored_alike(picture: MapPicture, sources: Sources, plan: DeliveryPlan, name: str) -> bool:
    """Return whether the capture's own file will do: 16 bit PNG of that size, sRGB or OpenGL."""
    source = sources.paths[name]
    right = plan.colour == "srgb" if picture.kind == COLOUR else plan.normals == "opengl"
    return (
        right
        and name not in sources.toned
        and plan.pictures == "png16"
        and source.suffix == ".png"
        and images.bits(source) == 16
        and images.size(source) == (sources.size, sources.size)
    )


def _square(path: Path, pixels: np.ndarray) -> np.ndarray:
    """Return the pixels [S, S(, C)]. Raises Problem for a map of another shape."""
    height, width = pixels.shape[:2]
    if width != height:
        raise Problem(
            f"{path} is {width} x {height}, but a map is square.",
            advise_remaking(path, "Run the stage that makes it again."),
        )
    return pixels


def _sized(pixels: np.ndarray, size: int, unit: bool) -> np.ndarray:
    """Reduce [S, S(, C)] by averaging; normals (`unit`) keep length 1."""
    if pixels.shape[:2] == (size, size):
        return pixels
    pixels = images.resize(pixels, size, size)
    return pixels / np.maximum(np.linalg.norm(pixels, axis=2, keepdims=True), 1e-6) if unit else pixels

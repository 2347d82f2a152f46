# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The identity space: principal components of random combinations of MakeHuman's macro and head targets."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from core.stages.cameras.landmarks import similarity

from .makehuman import Base, HeadBuilder

COMPONENTS = 40  # principal directions that are kept
SAMPLES = 700  # heads that they are told from
_HIGH = {
    "decr": "incr",
    "down": "up",
    "in": "out",
    "backward": "forward",
    "compress": "uncompress",
    "concave": "convex",
}
_LOW = {high: low for low, high in _HIGH.items()}
_FOLDERS = {
    "head": 0.17,
    "forehead": 0.25,
    "eyebrows": 0.25,
    "eyes": 0.2,
    "nose": 0.28,
    "mouth": 0.23,
    "cheek": 0.3,
    "chin": 0.27,
    "ears": 0.25,
}
_LEFT_OUT = re.compile(
    r"head-trans|head-angle|head-scale-horiz|head-back|eye-scale|mouth-trans-(in|out)|nose-trans-(in|out)|head-age"
    r"|chin-jaw-drop|mouth-dimples|ear-trans|asym"
)


def identity_space(base: Base, builder: HeadBuilder) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean head [V, 3] in metres, exactly symmetric, and displacements [K, V, 3], largest first.

    One standard deviation each.
    """
    heads = np.stack([builder.head(body) for body in bodies(base, SAMPLES)])
    front = (heads[0, :, 1] < 0.045) & (heads[0, :, 2] > -0.12)
    heads = np.stack([_aligned(head, heads[0], front) for head in heads])
    mirrored = heads[:, builder.mirror] * [-1, 1, 1]
    mean = (heads.mean(0) + mirrored.mean(0)) / 2
    mean -= [0, *(mean[front].mean(0)[1:] - heads[0, front].mean(0)[1:])]
    difference = (heads - heads.mean(0)).reshape(SAMPLES, -1)
    eigenvalues, vectors = np.linalg.eigh(difference @ difference.T / SAMPLES)
    order = np.argsort(eigenvalues)[::-1][:COMPONENTS]
    components = (vectors[:, order].T @ difference / np.sqrt(SAMPLES)).reshape(COMPONENTS, -1, 3)
    return mean, components


def bodies(base: Base, count: int, seed: int = 0) -> Iterator[np.ndarray]:
    """Draw the bodies [N, 3], decimetres, of which the identity space is made."""
    rng = np.random.default_rng(seed)
    controls = _controls(base)
    macros = {name: base.target(name) for name in base.target_names("macrodetails") if re.search("young|old", name)}
    for _ in range(count):
        yield base.vertices + _macro(macros, rng) + _details(controls, rng)


def _controls(base: Base) -> list[tuple[float, list[np.ndarray]]]:
    """Return the controls of detail: deviation and targets [low, high] or [only]; left and right are one control."""
    controls = []
    for folder, sigma in _FOLDERS.items():
        targets = {}
        for name in base.target_names(folder):
            stem = re.sub(r"/[lr]-", "/", name)
            if not _LEFT_OUT.search(name):
                targets[stem] = targets.get(stem, 0) + base.target(name)
        for stem, target in targets.items():
            part, _, end = stem.rpartition("-")
            low, high = (f"{part}-{ends.get(end)}" for ends in (_LOW, _HIGH))
            if high in targets:
                controls.append((sigma, [target, targets[high]]))
            elif low not in targets:
                controls.append((sigma, [target]))
    return controls


def _details(controls: list, rng: np.random.Generator) -> np.ndarray:
    """Draw a displacement of the body [N, 3], decimetres."""
    total = np.zeros_like(controls[0][1][0])
    for sigma, targets in controls:
        value = float(np.clip(rng.normal(0, sigma), -0.9, 0.9))
        total += abs(value) * targets[-1 if value > 0 else 0] * (1 if len(targets) == 2 else 0.7)
    return total


def _macro(macros: dict[str, np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Draw gender, age, ancestry, muscle and weight, blended as MakeHuman does: products of the factors' shares."""
    gender = np.clip(rng.choice([0.1, 0.9]) + rng.normal(0, 0.15), 0, 1)
    old = np.clip(abs(rng.normal(0, 0.4)), 0, 1)
    share = {"female": 1 - gender, "male": gender, "young": 1 - old, "old": old}
    share |= dict(zip(("african", "asian", "caucasian"), rng.dirichlet([0.5] * 3), strict=True))
    for kind in ("muscle", "weight"):
        level = float(np.clip(rng.normal(0, 0.4), -1, 1))
        share |= {f"min{kind}": max(-level, 0), f"max{kind}": max(level, 0), f"average{kind}": 1 - abs(level)}
    total = 0
    for name, offset in macros.items():
        factors = name.split("/")[1].removeprefix("universal-").split("-")
        weight = np.prod([share[f] for f in factors])
        total = total + weight * offset
    return total


def _aligned(head: np.ndarray, to: np.ndarray, region: np.ndarray) -> np.ndarray:
    """Move a head rigidly onto another by least squares over the vertices of `region`."""
    _, rotation, _ = similarity(head[region], to[region], np.ones(region.sum()))
    return (head - head[region].mean(0)) @ rotation.T + to[region].mean(0)

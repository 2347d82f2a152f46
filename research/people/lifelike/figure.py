# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole person: head, eyes, hair, clothes, and the skin's maps with and without what grows on it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from core.face.lids import OpenHead, open_around, open_lids
from core.face.strands import SkinSurface, Strands
from core.geometry.meshes import Mesh, joined

from ..canvas import canvas
from ..regions import regions
from ..skin import GROUND, Skin, paint_skin
from . import beards, brows, eyes, head_hair, traits
from .clothes import shirt
from .expression import Expression
from .ground import ground_of
from .person import Person, sample_person
from .shape import person_mesh

PARTS = ("skin", "lips", "brows", "lashes", "beard", "hair", "eyes", "clothes")
"""What is told apart in the truth."""
OPENEST = 0.2  # lids that are less open than this are shut
# how much of the hair's colour the skin between the roots takes where they are densest
UNDER = {"hair": 0.8, "beard": 0.35, "brows": 0.15}


@dataclass(frozen=True)
class Figure:
    """A person ready to be filmed.

    head: closed, in the template's topology; opened: with its lids as they are; skin: the bare skin's maps; seen
    float32 [S, S, 3]: its linear albedo between the roots of hair; eye [E, E, 3]: the eyes' albedo; growth: UV map of
    each growth in [0, 1], [S, S] by part; strands: all hairs.
    """

    person: Person
    head: Mesh
    opened: OpenHead
    shirt: Mesh
    skin: Skin
    seen: np.ndarray
    eye: np.ndarray
    growth: dict[str, np.ndarray]
    strands: tuple[Strands, ...]


def make_figure(
    person: Person | int, size: int = 2048, facekit: Path | None = None, expression: Expression | None = None
) -> Figure:
    """Make a person, or the one of a seed, with maps of `size` texels; the same arguments give the same bytes."""
    person = person if isinstance(person, Person) else sample_person(person)
    head = person_mesh(person.seed, facekit)
    openness = person.openness if person.openness >= OPENEST else 0.0
    open_head = open_lids(head, openness, np.array(person.gaze))
    if expression is not None:  # the eyeballs stay
        head = head.moved(head.vertices + expression.moves)
        open_head = open_around(head, open_head.balls, (openness * expression.lids,) * 2)
    skin, albedo, growth = paint(person, size)
    cloth = shirt(person, head)
    eye = eyes.paint_eyes(np.array(person.iris), open_head.balls[0].radius, person.seed)
    return Figure(person, head, open_head, cloth, skin, albedo, eye, growth, grow_hair(person, head, open_head, cloth))


def paint(person: Person, size: int) -> tuple[Skin, np.ndarray, dict[str, np.ndarray]]:
    """Return the bare skin's maps, its albedo between the roots [S, S, 3], and hair's density [S, S] by part."""
    on = canvas(size)
    skin = paint_skin(person.skin, on, canvas(GROUND), traits.broad_traits(person, on), hair=False)
    diffuse = traits.shaded(person, on, skin.diffuse[on.covered])
    skin = replace(skin, diffuse=on.spread(diffuse))
    growth = {"brows": np.clip(1.6 * regions(on)["brows"] - 0.3, 0, 1) * min(person.brow, 1.0)}
    if person.beard != "none":
        growth["beard"] = beards.beard_density(person.beard, on, np.random.default_rng([person.seed, 65]))
    if person.hair != "none":
        growth["hair"] = head_hair.scalp_density(on, person.seed)
    for region, where in growth.items():
        colour = np.asarray(person.brow_colour if region == "brows" else person.hair_colour, np.float32)
        share = (UNDER[region] if person.beard != "stubble" or region != "beard" else 0.1) * where[:, None]
        diffuse = diffuse * (1 - share) + np.minimum(colour, diffuse) * share
    grows = {region: on.spread(where.astype(np.float32)) for region, where in growth.items()}
    return skin, on.spread(diffuse.astype(np.float32)), grows


def grow_hair(person: Person, head: Mesh, opened: OpenHead, cloth: Mesh) -> tuple[Strands, ...]:
    """Grow all hairs of a person; long hair lies on `cloth`."""
    ground, skin = ground_of(head), SkinSurface(head)
    rngs = [np.random.default_rng([person.seed, 68, growth]) for growth in range(4)]
    strands = [brows.grow_brows(person, ground, skin, rngs[0]), brows.grow_lashes(person, opened, rngs[1])]
    if person.beard != "none":
        strands.append(beards.grow_beard(person, ground, skin, rngs[2]))
    if person.hair != "none":
        strands.append(head_hair.grow_head_hair(person, ground, SkinSurface(joined([head, cloth])), rngs[3]))
    return tuple(strands)

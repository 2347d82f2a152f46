# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delivery presets: names, packing, units and normals of the maps per target, and what each file format drops.

Shown by the add-on beside the choice, by `python -m core presets`, and in docs/guide/deliver.md.
"""

from __future__ import annotations

from dataclasses import dataclass

COLOUR, NORMAL, DATA = "colour", "normal", "data"
ALBEDO = ("albedo.r", "albedo.g", "albedo.b")
TANGENT = ("normal.x", "normal.y", "normal.z")
F0 = ("f0", "f0", "f0")


@dataclass(frozen=True)
class MapPicture:
    """One file of a map set.

    `channels` are terms of core/deliver/maps.py or the constants "0" and "1". COLOUR is stored in the chosen colour
    space, NORMAL as OpenGL or DirectX, DATA as it is. `slot` is the linked input of the exported material, '' for none.
    """

    name: str
    channels: tuple[str, ...]
    kind: str = DATA
    slot: str = ""


@dataclass(frozen=True)
class Format:
    """Mesh file. `drops`: sentences on what it loses. `unit` and `normals` '': the preset decides."""

    title: str
    suffix: str
    drops: tuple[str, ...]
    unit: str = ""
    normals: str = ""
    pictures: tuple[str, ...] = ("png8", "png16", "exr")
    shape_keys: bool = True


@dataclass(frozen=True, kw_only=True)
class DeliveryPreset:
    """Target program. `hint` says how to import the delivery; `open_eyes`: open lids and no shape keys.

    Y is up in every format but USD, which has its own axis.
    """

    title: str
    hint: str
    maps: tuple[MapPicture, ...]
    format: str = "fbx"
    unit: str = "cm"
    normals: str = "opengl"
    pictures: str = "png8"
    numbered: bool = False
    open_eyes: bool = False


_GLTF = (
    "glTF has no subsurface scattering and no displacement: set them in the program that opens it.",
    "Roughness is one value in it, and the specular map is not linked: both maps lie beside the file.",
)
FORMATS = {
    "glb": Format("glTF, one file", ".glb", _GLTF, unit="m", normals="opengl", pictures=("png8", "png16")),
    "gltf": Format("glTF with files", ".gltf", _GLTF, unit="m", normals="opengl", pictures=("png8", "png16")),
    "usd": Format(
        "USD",
        ".usdc",
        (
            "USD's preview material has no subsurface scattering; displacement and the specular map lie beside "
            "the file.",
        ),
        unit="m",
        normals="opengl",
    ),
    "fbx": Format(
        "FBX",
        ".fbx",
        (
            "FBX's material has no subsurface scattering, so no scale of it either, and no displacement.",
            "What does not read FBX's roughness and specular links needs those maps set by hand.",
        ),
        unit="cm",
    ),
    "obj": Format(
        "OBJ",
        ".obj",
        (
            "OBJ has no shape keys and no units.",
            "Its MTL has no subsurface scattering, and cannot mark maps as non-colour data: "
            "in Blender set all but the albedo to Non-Color.",
        ),
        shape_keys=False,
    ),
}

PICTURES = {"png8": "PNG, 8 bit", "png16": "PNG, 16 bit", "exr": "EXR, half float"}

PRESETS = {
    "blender": DeliveryPreset(
        title="Blender",
        hint="Import it: the maps are linked; for skin with scattering, Assemble Material in this add-on.",
        format="glb",
        unit="m",
        pictures="png16",
        maps=(
            MapPicture("{name}_albedo", ALBEDO, COLOUR, "base_color"),
            MapPicture("{name}_normal", TANGENT, NORMAL, "normal"),
            MapPicture("{name}_roughness", ("roughness",), DATA, "roughness"),
            MapPicture("{name}_specular_level", ("level",)),
        ),
    ),
    "metahuman": DeliveryPreset(
        title="MetaHuman from Mesh",
        hint="Import it as a static mesh for a MetaHuman Identity, which wants open eyes: the head has them, and no "
        "shape keys.",
        normals="directx",
        maps=(MapPicture("T_{name}_Color", ALBEDO, COLOUR, "base_color"),),
        open_eyes=True,
    ),
    "unreal": DeliveryPreset(
        title="Unreal",
        hint="Leave Flip Green Channel off; switch sRGB off for all maps but BaseColor.",
        normals="directx",
        maps=(
            MapPicture("T_{name}_BaseColor", ALBEDO, COLOUR, "base_color"),
            MapPicture("T_{name}_N", TANGENT, NORMAL, "normal"),
            MapPicture("T_{name}_ORM", ("1", "roughness", "0")),
            MapPicture("T_{name}_Specular", ("unreal_specular",), DATA, "specular"),
        ),
    ),
    "unity_hdrp": DeliveryPreset(
        title="Unity HDRP",
        hint="A Lit material of the type Subsurface Scattering; reflectance at normal incidence comes from its "
        "diffusion profile (IOR 1.4).",
        maps=(
            MapPicture("{name}_BaseMap", ALBEDO, COLOUR, "base_color"),
            MapPicture("{name}_NormalMap", TANGENT, NORMAL, "normal"),
            MapPicture("{name}_MaskMap", ("0", "1", "1", "smoothness")),
        ),
    ),
    "unity_urp": DeliveryPreset(
        title="Unity URP",
        hint="A Lit material with the workflow Specular; its smoothness is in the specular map's alpha.",
        maps=(
            MapPicture("{name}_BaseMap", ALBEDO, COLOUR, "base_color"),
            MapPicture("{name}_BumpMap", TANGENT, NORMAL, "normal"),
            MapPicture("{name}_SpecGlossMap", (*F0, "smoothness"), COLOUR),
        ),
    ),
    "character_creator": DeliveryPreset(
        title="Character Creator",
        hint="Give it to Headshot's mesh mode, or as a prop with the maps in its PBR channels.",
        format="obj",
        maps=(
            MapPicture("{name}_Diffuse", ALBEDO, COLOUR, "base_color"),
            MapPicture("{name}_Normal", TANGENT, NORMAL, "normal"),
            MapPicture("{name}_Roughness", ("roughness",), DATA, "roughness"),
            MapPicture("{name}_Specular", ("weight",), DATA, "specular"),
        ),
    ),
    "arnold": DeliveryPreset(
        title="Arnold",
        hint="The files are named after standard_surface's parameters: specular is a weight for specular_IOR 1.4.",
        pictures="exr",
        numbered=True,
        maps=(
            MapPicture("{name}_base_color", ALBEDO, COLOUR, "base_color"),
            MapPicture("{name}_normal_camera", TANGENT, NORMAL, "normal"),
            MapPicture("{name}_specular", ("weight",), DATA, "specular"),
            MapPicture("{name}_specular_roughness", ("roughness",), DATA, "roughness"),
            MapPicture("{name}_displacement", ("displacement",)),
        ),
    ),
    "redshift": DeliveryPreset(
        title="Redshift",
        hint="The files are named after the Standard Material's inputs: refl_weight is for refl_ior 1.4.",
        pictures="exr",
        numbered=True,
        maps=(
            MapPicture("{name}_base_color", ALBEDO, COLOUR, "base_color"),
            MapPicture("{name}_bump_input", TANGENT, NORMAL, "normal"),
            MapPicture("{name}_refl_weight", ("weight",), DATA, "specular"),
            MapPicture("{name}_refl_roughness", ("roughness",), DATA, "roughness"),
            MapPicture("{name}_displacement", ("displacement",)),
        ),
    ),
}

HAIR = (
    MapPicture("{name}_brows_mask", ("brows",)),
    MapPicture("{name}_lashes_mask", ("lashes",)),
    MapPicture("{name}_beard_mask", ("beard",)),
    MapPicture("{name}_clean_albedo", ("clean.r", "clean.g", "clean.b"), COLOUR),
)
"""Added to every preset if the capture has them: masks to groom hair by, and the skin below."""

WHAT = {
    "head": ("Head", "The head in its own UVs, with its shape keys"),
    "own_mesh": ("My Mesh", "Your own head mesh, fitted to the face, with the maps in its UVs"),
    "scan": ("Scan", "The raw scan with UVs, as filmed and as albedo"),
}
SCAN_MAPS = (
    MapPicture("{name}_albedo", ALBEDO, COLOUR, "base_color"),
    MapPicture("{name}_lit", ("lit.r", "lit.g", "lit.b"), COLOUR),
)
"""Maps of the scan, for every preset."""


def markdown() -> str:
    """Format the tables of docs/guide/deliver.md."""
    lines = ["| preset | mesh | unit | normals | pictures | maps |", "| --- | --- | --- | --- | --- | --- |"]
    for preset in PRESETS.values():
        names = ", ".join(
            f"`{picture.name.format(name='NAME')}{'.1001' if preset.numbered else ''}`" for picture in preset.maps
        )
        format = FORMATS[preset.format]
        normals = {"opengl": "OpenGL, Y+", "directx": "DirectX, Y-"}[format.normals or preset.normals]
        row = (preset.title, format.title, format.unit or preset.unit, normals, PICTURES[preset.pictures], names)
        lines.append(f"| {' | '.join(row)} |")
    lines += ["", "| format | what it drops |", "| --- | --- |"]
    return "\n".join(
        [*lines, *(f"| {each.title} (`{each.suffix}`) | {' '.join(each.drops)} |" for each in FORMATS.values())]
    )

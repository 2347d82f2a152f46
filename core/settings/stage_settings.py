# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One frozen dataclass per stage: the only declaration of its settings.

Blender's panels, the command line, the inputs of a stage's result and the paths to check follow from it. The docstring
below a field is its tooltip in Blender and its help on the command line.
"""

from __future__ import annotations

from dataclasses import dataclass

from . import delivery_presets
from .colour_values import parse_skin_tone, parse_white_point
from .setting_values import setting


@dataclass(frozen=True)
class FramesSettings:
    max_frames: int = setting(300, min=3, max=1000)
    """Frames taken from the video at equal intervals"""
    long_side: int = setting(960, min=320, max=3840, unit="px")
    """Longer side of the extracted frames"""
    views: int = setting(16, min=3, max=64)
    """Sharp, evenly spread frames chosen for the texture (V in the paper)"""
    colour: str = setting(
        "recorded",
        choices=("recorded", "apple_log", "s_log3", "v_log", "linear"),
        titles={
            "recorded": "As Recorded",
            "apple_log": "Apple Log",
            "s_log3": "S-Log3",
            "v_log": "V-Log",
        },
        flag="--colour",
        per_face=True,
    )
    """How the colours were recorded, where the file does not say it. As Recorded: as the file says, else as plain
    video. The logs are with their cameras' gamuts: Rec. 2020, S-Gamut3.Cine, V-Gamut"""
    mirrored: bool = setting(False, per_face=True)
    """The pictures are mirrored, as a front camera may save them: flip them back. A head alone cannot show which way
    round it was"""
    no_glasses: bool = setting(False, per_face=True)
    """The person wears no glasses, whatever the frames look like. Off: a capture that shows glasses is refused"""


@dataclass(frozen=True)
class CamerasSettings:
    interpupillary_mm: float = setting(63.0, min=40.0, max=80.0, unit="mm", per_face=True)
    """Distance between the pupils; sets the scale of the head"""
    matching: str = setting("auto", choices=("auto", "sequential", "exhaustive"))
    """Which frames are matched with each other; auto: neighbours in a video, all pairs in a few photographs"""
    features: str = setting("auto", choices=("auto", "plain", "skin", "face"))
    """What the cameras are found by; skin holds on low-contrast faces and costs ten times as much, face uses its
    landmarks alone; auto tries plain first"""
    import_from: str = setting("", path="file_or_folder", flag="--cameras")
    """Cameras of another program: COLMAP's folder, Metashape's .xml, RealityScan's .csv, Blender's .json; empty: solve
    them here"""


@dataclass(frozen=True)
class ScanSettings:
    method: str = setting("auto", choices=("auto", "stereo", "splats"))
    """stereo runs anywhere; splats are Gaussian surfels and need an NVIDIA GPU with gsplat; auto takes splats where
    they can run"""
    pairs: int = setting(24, min=2, max=400)
    """Stereo pairs that are matched and fused"""
    voxel_mm: float = setting(1.0, min=0.3, max=5.0, unit="mm")
    """Size of a voxel of the fused surface"""


@dataclass(frozen=True)
class RegistrationSettings:
    iterations: int = setting(30, min=1, max=200)
    """Steps of the non-rigid fit, stiff to soft"""
    template: str = setting("", path="file_or_folder", flag="--template")
    """A head mesh of your own, fitted beside the built-in one: an OBJ, or a folder with a neutral OBJ and its shapes
    (as ICT-FaceKit)"""
    new_atlas: bool = setting(False, flag="--new-atlas", per_face=True)
    """Make new UVs for your own head mesh where its own are missing or overlap"""


@dataclass(frozen=True)
class DelightSettings:
    delighter: str = setting(
        "network",
        choices=("network", "shading", "switchlight", "opendelight", "folder", "none"),
        flag="--delighter",
        per_face=True,
    )
    """How the light is taken out of the frames before the texture is built"""
    torch: str = setting("auto", choices=("auto", "on", "off"), flag="--torch", per_face=True)
    """Whether the phone's torch was on while filming. On: its light is known and taken out, without delighter or mask;
    auto: a film whose light moves with the camera is told"""
    switchlight_preview: bool = setting(
        False, label="Small Pictures at Half the Credits", flag="--preview", per_face=True
    )
    """Have SwitchLight answer with pictures of at most 512 px, at half the credits: to see whether it helps"""
    folder: str = setting("", path="folder", flag="--folder", when=lambda own: own.delighter == "folder", required=True)
    """Folder of delit pictures for the folder delighter, matched by name"""
    checkpoint: str = setting(
        "",
        path="file_or_folder",
        flag="--checkpoint",
        required=True,
        when=lambda own: own.delighter == "opendelight",
        holds=("base_delight_network.pth",),
    )
    """OpenDelight's checkpoint as its authors publish it: the folder with base_delight_network.pth and
    unet_enhancer.pth"""


@dataclass(frozen=True)
class TextureSettings:
    size: int = setting(1024, min=256, max=4096, unit="px")
    """Side of the texture"""
    perceptual: int = setting(0, min=0, max=2000, label="Perceptual Steps")
    """Steps that sharpen the texture until the head looks like the frames to a network, as the paper does; 0 is off"""
    perceptual_network: str = setting("", path="file_or_folder", when=lambda own: own.perceptual > 0)
    """VGG16 file, or folder with it and LPIPS's weights, for these steps; empty takes the small network of an installed
    package"""


@dataclass(frozen=True)
class ShadowMaskSettings:
    sensitivity: float = setting(0.5, min=0.0, max=1.0)
    """How readily a dark region is taken for a shadow"""
    dilate_px: int = setting(8, min=0, max=64, unit="px")
    """How far the proposal is grown, at a 1024 px texture; where the texture shows the shadow's edge it is laid on
    that"""
    softened: str = setting("", path="folder", label="Frames With Softened Shadows", flag="--softened")
    """Folder of the frames with their shadows softened by any tool, matched by name: what that lightens is proposed.
    Empty: the delighter tells"""


@dataclass(frozen=True)
class SolveSettings:
    size: int = setting(1024, min=128, max=1024, unit="px")
    """Side of the map that is solved"""
    recipe: str = setting("wildcap", choices=("wildcap", "paper", "released"), titles={"wildcap": "WildCap"})
    """wildcap is the default; paper and released do as the paper and its authors' code, but for noise levels and light
    around the mask (paper), cubemap and soft masks (released); their 600 and 599 steps are many times slower"""
    steps: int = setting(20, min=4, max=600)
    """Sampling steps"""
    guidance: str = setting("dps", choices=("dps", "proximal"), titles={"dps": "DPS"})
    """dps follows the paper through the network's gradient; proximal is a closed form, twice as fast"""
    grid_cells: int = setting(96, min=1, max=512)
    """Cells per side of the texel grid of lights over the whole map's face crop (96 cells of 8 texels at 1024)"""
    skin_tone: str = setting(
        "auto",
        form="R,G,B or #RRGGBB or a swatch's number or auto",
        parse=parse_skin_tone,
        flag="--skin-tone",
        per_face=True,
        affects_result=False,
    )
    """Skin tone in sRGB (linear mean over facial skin), as 0.69,0.54,0.46 or 176,138,118 or #B08A76, or a swatch of
    measured skin in this person's hue, 1 (light) to 10 (dark); auto: estimated. Changed after the solve, it is baked
    into the skin when the head is delivered"""
    white_point: str = setting(
        "auto", form="R,G,B or auto", parse=parse_white_point, flag="--white-point", per_face=True
    )
    """What a white surface in the face's light is in the frames, linear R,G,B, from a ColorChecker, a grey card or
    white paper; auto: from the scene"""
    prior: str = setting("", path="folder", flag="--prior", holds=("config.json", "ckpt.pth"))
    """The authors' prior: the folder with its config.json and ckpt.pth. It needs ICT-FaceKit fitted as template, in
    whose UVs it works; empty: ours"""
    together: str = setting("", path="folder", label="Combine With", flag="--with")
    """Another capture of the same person in other light, or a folder of several: what they agree on is skin, what
    differs is light. Empty: alone"""
    checkpoint_every: int = setting(5, min=1, max=600, affects_result=False)
    """Steps between two checkpoints"""
    low_memory: bool = setting(False, affects_result=False)
    """Use a third less memory for the same maps, at two thirds more time. Without it this begins where the memory does
    not suffice"""


@dataclass(frozen=True)
class UpscaleSettings:
    size: int = setting(4096, min=1024, max=8192, unit="px")
    """Side of the delivered maps"""
    method: str = setting("network", choices=("network", "lanczos"))
    """How albedo, normals and specular become four times as large: by the network, which sharpens, or by Lanczos
    resampling, which is quick"""
    frames_detail: bool = setting(True)
    """Take pores and the edges of moles from the frames, where those show more than the texture can hold"""
    whole_head: bool = setting(True)
    """Complete neck, ears, scalp and the back of the head from the solved face where no camera saw them; off: the mean
    face's plain tone"""
    hair: bool = setting(True)
    """Find brows, lashes and beard: a mask of each, the albedo of the skin below them, and single hairs for Grow
    Hair"""


@dataclass(frozen=True)
class RetouchSettings:
    """What the tools Import Layer and Copy From a Frame are asked for; the stage itself has no settings."""

    picture: str = setting("", form="a path", private=True, affects_result=False)
    """Picture to import as a layer, with its folder"""
    over: str = setting("albedo", choices=("albedo", "specular", "normal"), affects_result=False)
    """Map that the picture is laid over"""
    layer: str = setting("", form="a name", private=True, affects_result=False)
    """Name of the layer; empty: that of the picture"""
    whole: bool = setting(False, affects_result=False)
    """Take a picture without alpha, which covers all that is below"""
    frame: str = setting("", form="a frame's name", affects_result=False)
    """Frame to unfold onto the head"""
    size: int = setting(2048, min=256, max=8192, unit="px", affects_result=False)
    """Side of the unfolded frame"""


@dataclass(frozen=True)
class TransferSettings:
    size: int = setting(4096, min=256, max=8192, unit="px")
    """Side of each map that is baked into the UVs of your own head mesh"""
    scan: bool = setting(True)
    """Deliver the scan as well, with UVs, lit and albedo texture, and the head's displacement"""
    scan_size: int = setting(1024, min=256, max=8192, unit="px")
    """Side of the scan's textures and of the displacement map"""
    scan_detail_mm: float = setting(3.0, min=1.0, max=10.0, unit="mm")
    """Size of the delivered scan's triangles"""


@dataclass(frozen=True)
class DeliverSettings:
    """A delivery; delivery_presets.py has names and packing of the maps."""

    preset: str = setting("blender", choices=tuple(delivery_presets.PRESETS), flag="--preset")
    """The program it is for: its names of the maps, its units, its normals"""
    what: str = setting("head", choices=tuple(delivery_presets.WHAT), label="Mesh", flag="--what")
    """Which mesh is delivered"""
    format: str = setting("preset", choices=("preset", *delivery_presets.FORMATS), label="File")
    """File of the mesh; preset: what that program likes best"""
    size: str = setting("4096", choices=("4096", "2048", "1024"), unit="px", flag="--size")
    """Side of the maps; maps that are smaller are not enlarged"""
    pictures: str = setting("preset", choices=("preset", *delivery_presets.PICTURES), flag="--pictures")
    """File of the maps"""
    colour: str = setting("preset", choices=("preset", "srgb", "linear"), titles={"srgb": "sRGB"}, flag="--colour")
    """Colour space of the albedo; preset: sRGB in PNG, linear in EXR"""
    udim: str = setting("preset", choices=("preset", "numbered", "plain"), label="UDIM", flag="--udim")
    """Whether the maps' names carry the number of their UV tile (1001); maps of several tiles always do"""
    hair: bool = setting(True, label="Hair Masks", flag="--no-hair")
    """Masks of brows, lashes and beard and the skin below them go along, where the capture has them"""
    clean: bool = setting(False, label="Skin Without Hair", flag="--clean")
    """The albedo without brows, lashes and beard, to groom hair over it, in place of the one with them"""
    folder: str = setting("", path="folder", label="Output Folder", flag="--to", affects_result=False)
    """Folder to deliver to; empty: exports in the capture's folder"""
    roughness: int = setting(45, min=0, max=100, unit="percent")
    """Roughness of the cheeks, in the maps and materials that hold it; Blender puts in what the head's material has"""
    replace: bool = setting(False, label="Replace Changed Files", flag="--replace")
    """Give up what was changed in the files of an older delivery to the same folder; off: such a delivery is refused.
    Files of others stay in any case"""
    whole: bool = setting(False)
    """Write the mesh as well, without Blender, as OBJ"""

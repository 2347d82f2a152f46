# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of the .blend: the list of captures and each one's settings.

The groups are built from core.settings, which has every setting's default, range, unit and tooltip. Run-time state is
in `jobs` and `status`.
"""

from dataclasses import fields

import bpy

from ..core.capture import retouch_layers, stages
from ..core.settings import delighter_cards, delivery_presets, skin_swatches
from ..core.settings import settings as core_settings
from ..core.settings.setting_values import absolute_path
from ..core.settings.settings import STAGE_KINDS
from . import captures, layers, preferences, tones
from . import hdri as worlds

SUBTYPES = {"file": 'FILE_PATH', "file_or_folder": 'FILE_PATH', "folder": 'DIR_PATH'}
"""Subtypes of paths; a browser for files also accepts a folder's name."""
SHARED_TOOLTIPS = core_settings.tooltips(core_settings.Settings)


def settings_group(stage: str, kind: type) -> type:
    """Return a PropertyGroup with one property per field of a stage's settings."""
    annotations = {f.name: _property(f, core_settings.tooltips(kind)[f.name]) for f in fields(kind)}
    return type(
        f"WILDCAP_PG_{stage}", (bpy.types.PropertyGroup,), {"__annotations__": annotations, "__doc__": kind.__doc__}
    )


def _property(field, tooltip: str):
    unit = field.metadata.get("unit")
    words = field.name.removesuffix(f"_{unit}").replace("_", " ").title()
    name = field.metadata.get("label") or words + (f" ({unit})" if unit else "")
    common = {"name": name, "description": tooltip, "default": field.default}
    limits = {k: field.metadata[k] for k in ("min", "max") if k in field.metadata}
    if "choices" in field.metadata:
        return bpy.props.EnumProperty(items=[_choice(field, c) for c in field.metadata["choices"]], **common)
    if isinstance(field.default, bool):
        return bpy.props.BoolProperty(**common)
    if isinstance(field.default, int):
        return bpy.props.IntProperty(**common, **limits)
    if isinstance(field.default, float):
        return bpy.props.FloatProperty(**common, **limits)
    return bpy.props.StringProperty(**common, subtype=SUBTYPES.get(field.metadata.get("path"), 'NONE'))


def _choice(field, value: str) -> tuple[str, str, str]:
    """Return an item of an EnumProperty: identifier, name, description."""
    card = delighter_cards.CARDS.get(value) if field.name == "delighter" else None
    if card:
        return value, card.title, card.what
    if field.name == "preset":
        return value, delivery_presets.PRESETS[value].title, delivery_presets.PRESETS[value].hint
    if field.name == "format" and value != "preset":
        return value, delivery_presets.FORMATS[value].title, " ".join(delivery_presets.FORMATS[value].drops)
    if field.name == "what":
        return value, *delivery_presets.WHAT[value]
    titles = {"preset": "From the Preset", **delivery_presets.PICTURES, **field.metadata.get("titles", {})}
    return value, titles.get(value) or value.replace("_", " ").title(), ""


GROUPS = {stage: settings_group(stage, kind) for stage, kind in STAGE_KINDS.items()}


def _apply_quality(self, context):
    preset = core_settings.preset(self.quality)
    for stage in stages.NAMES:
        for name in core_settings.quality_settings(STAGE_KINDS[stage]):
            setattr(getattr(self, stage), name, getattr(getattr(preset, stage), name))


def _hand_on_tone(self, context):
    tones.hand_on(self)


def _hand_on_layer(self, context):
    for item in captures.listed():
        if any(row == self for row in item.layers):
            layers.hand_on(self, item)


class WILDCAP_PG_layer(bpy.types.PropertyGroup):
    """Row of an artist's layer; `name` is its name."""

    name: bpy.props.StringProperty(name="Name", maxlen=retouch_layers.LONGEST_NAME, update=_hand_on_layer)
    file: bpy.props.StringProperty(name="File", options={'HIDDEN'}, description="Its file in the capture")
    map: bpy.props.StringProperty(name="Map", options={'HIDDEN'}, description="The map that it lies over")
    visible: bpy.props.BoolProperty(
        name="Visible", default=True, update=_hand_on_layer, description="Lay this layer over the maps"
    )
    opacity: bpy.props.FloatProperty(
        name="Opacity",
        subtype='FACTOR',
        min=0,
        max=1,
        default=1,
        update=_hand_on_layer,
        description="How far the layer covers what is below",
    )
    locked: bpy.props.BoolProperty(
        name="Keep Colours",
        default=False,
        update=_hand_on_layer,
        description="Keep its colours when the skin tone changes, as of make-up or a tattoo; off: they follow the tone",
    )


class WILDCAP_PG_capture(bpy.types.PropertyGroup):
    """Item of the scene's list: one capture folder."""

    path: bpy.props.StringProperty(
        name="Capture Folder", subtype='DIR_PATH', description="The folder that holds everything about this face"
    )
    from_blend: bpy.props.StringProperty(
        name="From the .blend",
        options={'HIDDEN'},
        description="The folder as it was reached from the .blend when that was last saved",
    )
    head: bpy.props.PointerProperty(name="Head", type=bpy.types.Object, description="The head object of this capture")
    quality: bpy.props.EnumProperty(
        name="Quality",
        items=[(q, q.title(), "") for q in core_settings.QUALITIES],
        default="standard",
        update=_apply_quality,
        description="Draft for previews, standard for work, film for delivery. Choosing one sets the fields of all "
        "stages that it covers: change single ones afterwards",
    )
    device: bpy.props.EnumProperty(
        name="Device",
        default="auto",
        description=SHARED_TOOLTIPS["device"],
        items=[
            ("auto", "Automatic", "The device on which the solver's network ran fastest when it was set up"),
            ("cpu", "CPU", ""),
            ("cuda", "CUDA", ""),
            ("mps", "Metal", ""),
        ],
    )
    layers: bpy.props.CollectionProperty(type=WILDCAP_PG_layer)
    active_layer: bpy.props.IntProperty(name="Layer", description="The layer that is painted next")
    seed: bpy.props.IntProperty(name="Seed", min=0, default=0, description=SHARED_TOOLTIPS["seed"])
    use_skin_tone: bpy.props.BoolProperty(
        name="Set Skin Tone",
        default=False,
        update=_hand_on_tone,
        description="Use the colour below as the mean skin colour; off: it is estimated from the video",
    )
    skin_tone: bpy.props.FloatVectorProperty(
        name="Skin Tone",
        subtype='COLOR_GAMMA',
        size=3,
        min=0,
        max=1,
        default=(0.69, 0.54, 0.45),
        update=_hand_on_tone,
        description="Mean colour of the facial skin without lips, brows and stubble, as the eye sees it (sRGB)",
    )
    skin_warmth: bpy.props.FloatProperty(
        name="Warmer",
        min=-skin_swatches.WARMEST,
        max=skin_swatches.WARMEST,
        get=tones.warmth,
        set=tones.set_warmth,
        description="How much redder and less blue the skin is than it was filmed, in deviations among people of one "
        "lightness",
    )
    numbered_tone: bpy.props.FloatVectorProperty(
        name="Numbered Tone", size=3, options={'HIDDEN'}, description="Colour of a tone that was given by its number"
    )
    estimated_tone: bpy.props.FloatVectorProperty(
        name="Estimated Tone", size=3, options={'HIDDEN'}, description="Last estimated tone"
    )
    estimated_after: bpy.props.StringProperty(
        name="Estimated After", options={'HIDDEN'}, description="When the solve was finished that it came after"
    )
    tone_group: bpy.props.StringProperty(name="Tone Group", options={'HIDDEN'}, description="Name of the tone's group")
    tone_source: bpy.props.StringProperty(
        name="Tone Source", options={'HIDDEN'}, description="Source of the last estimate"
    )
    tone_deviation: bpy.props.FloatProperty(
        name="Tone Deviation", options={'HIDDEN'}, description="Standard deviation of its lightness L*"
    )


WILDCAP_PG_capture.__annotations__ |= {stage: bpy.props.PointerProperty(type=group) for stage, group in GROUPS.items()}


def _show_chosen(self, context):
    if self.id_data == context.scene:
        captures.choose(context)


LIGHTS = (
    ('three_point', "Three-Point", "Key, fill and rim from three soft boxes", 0),
    ('window', "Window", "One large window from the side", 2),
    ('sun', "Sun", "A low sun under a clear sky", 1),
    ('overcast', "Overcast", "A bright grey sky, three times as bright above as at the horizon; no lamp", 4),
    ('rim', "Rim", "Two strips from behind, and a breath of light from in front", 5),
    ('coloured', "Coloured", "Teal from one side, magenta from the other, a white strip from above", 6),
    ('hdri', "HDRI", "The surroundings of a panoramic picture", 3),
)
"""Identifier, name, tooltip, and the number that files store (0 was once named studio)."""


class WILDCAP_PG_scene(bpy.types.PropertyGroup):
    """Captures of the scene, and their light."""

    captures: bpy.props.CollectionProperty(type=WILDCAP_PG_capture)
    active_index: bpy.props.IntProperty(
        name="Capture", update=_show_chosen, description="The capture that the panel shows while no head is active"
    )
    light: bpy.props.EnumProperty(
        name="Light",
        default='three_point',
        items=[(name, label, what, "", number) for name, label, what, number in LIGHTS],
        description="The light for Render",
    )
    hdri: bpy.props.EnumProperty(
        name="Environment",
        items=worlds.items,
        description="Blender's own worlds, and those installed in its preferences (Lights)",
    )
    hdri_file: bpy.props.StringProperty(
        name="Own File",
        subtype='FILE_PATH',
        description="A panoramic HDR picture of your own; it replaces the one above",
    )
    hdri_rotation: bpy.props.FloatProperty(
        name="Rotation", subtype='ANGLE', description="Turns the light about the head, counter-clockwise from above"
    )
    hdri_strength: bpy.props.FloatProperty(
        name="Strength", min=0, soft_max=4, default=1, description="Brightness of the surroundings"
    )
    shadow_tint: bpy.props.FloatVectorProperty(
        name="Shadow Tint",
        subtype='COLOR',
        size=3,
        min=0,
        max=1,
        default=(1.0, 0.0, 0.0),
        description="Colour in which the shadow mask is shown",
    )
    protect_tint: bpy.props.FloatVectorProperty(
        name="Protect Tint",
        subtype='COLOR',
        size=3,
        min=0,
        max=1,
        default=(0.0, 0.6, 0.1),
        description="Colour in which the protect mask is shown",
    )
    tint_strength: bpy.props.FloatProperty(
        name="Tint Strength", min=0.05, max=1, default=0.45, description="Opacity of a mask over the texture"
    )
    layer_side: bpy.props.EnumProperty(
        name="Layer Size",
        default="2048",
        description="Texels of a side of the layer that is painted. A smaller one keeps the finer detail of the 4K "
        "maps below it; 4K needs some 2 GB of memory",
        items=[("1024", "1K", "1024 texels, as solved"), ("2048", "2K", "2048 texels"), ("4096", "4K", "4096 texels")],
    )
    resolution: bpy.props.IntProperty(
        name="Resolution", subtype='PIXEL', min=16, max=8192, default=1024, description="Side of the rendered picture"
    )
    samples: bpy.props.IntProperty(
        name="Samples", min=1, max=65536, default=128, description="Cycles samples per pixel"
    )
    view: bpy.props.EnumProperty(
        name="View",
        default='Standard',
        description="View transform of the picture; the linear EXR beside it is the same in both",
        items=[
            ('Standard', "Standard", "Colours as they are; what is brighter than white is cut off"),
            (
                'AgX',
                "AgX",
                "As on film: bright lights and strong colours fade softly, which changes the skin tone",
            ),
        ],
    )
    exposure: bpy.props.FloatProperty(
        name="Exposure",
        soft_min=-5,
        soft_max=5,
        min=-20,
        max=20,
        precision=2,
        description="Stops by which pictures are shown brighter than the lights are set; the linear EXR stays as it is",
    )
    turns: bpy.props.EnumProperty(
        name="Rotate",
        default='HEAD',
        description="What goes once around",
        items=[
            ('HEAD', "Head", "The head, under a light that stays"),
            ('LIGHT', "Light", "The light, around a head that stays"),
        ],
    )
    turn_frames: bpy.props.IntProperty(
        name="Frames", min=2, max=1000, default=48, description="Pictures of one turn; a video plays 24 per second"
    )
    turn_file: bpy.props.EnumProperty(
        name="Format",
        default='MP4',
        description="Format of renders/turntable",
        items=[('MP4', "Video", "One MP4"), ('PNG', "Pictures", "A PNG per frame")],
    )


def job_settings(item: WILDCAP_PG_capture) -> dict:
    """Return a capture's settings for a job file: stage -> {name: value}, seed, device. Paths are absolute."""
    stage_settings = {
        stage: {f.name: _value(getattr(item, stage), f) for f in fields(kind)} for stage, kind in STAGE_KINDS.items()
    }
    stage_settings["solve"]["skin_tone"] = tones.text(item)
    return {**stage_settings, "seed": item.seed, "device": device(item)}


def take(item: WILDCAP_PG_capture, quality: str, new_settings: core_settings.Settings) -> None:
    """Set the fields to a job's quality and settings."""
    item.quality = quality
    for stage, kind in STAGE_KINDS.items():
        for f in fields(kind):
            setattr(getattr(item, stage), f.name, getattr(getattr(new_settings, stage), f.name))
    tones.take(item, new_settings.solve.skin_tone)
    item.seed, item.device = new_settings.seed, new_settings.device


def _value(group, field):
    value = getattr(group, field.name)
    return absolute_path(bpy.path.abspath(value)) if "path" in field.metadata else value


def device(item: WILDCAP_PG_capture) -> str:
    """Return 'cpu', 'cuda' or 'mps': the capture's choice, else the solver's device; 'auto' before that is known."""
    return item.device if item.device != "auto" else preferences.get().device or "auto"


def settings(item: WILDCAP_PG_capture) -> core_settings.Settings:
    return core_settings.from_json(job_settings(item))


_register, _unregister = bpy.utils.register_classes_factory(
    (*GROUPS.values(), WILDCAP_PG_layer, WILDCAP_PG_capture, WILDCAP_PG_scene)
)


def register():
    _register()
    bpy.types.Scene.wildcap = bpy.props.PointerProperty(type=WILDCAP_PG_scene)


def unregister():
    del bpy.types.Scene.wildcap
    _unregister()

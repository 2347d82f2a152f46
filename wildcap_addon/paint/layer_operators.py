# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: make, paint, order, import and delete layers; the brushes and sources of their painting."""

import bpy

from ...core.capture import retouch_edits
from ...core.capture.frame_records import read_frames
from ...core.capture.messages import Problem
from .. import captures, jobs, layers
from ..base_operator import BaseOperator, CaptureOperator, Dialog, FileOperator, HeadOperator, JobOperator
from . import brush, layer_painting, layer_update, session
from .layer_painting import CANVAS

MAPS = [
    ('albedo', "Albedo", "The colour of the skin"),
    ('specular', "Specular", "How strong the gloss is"),
    ('normal', "Normal", "The fine relief"),
]
SOURCES = {
    'BELOW': "What is below this layer: takes the retouch away",
    'MIRROR': "The same place on the other side of the face",
    'FRAME': "A frame of the video, without its light",
}
BRUSHES = [
    ('DRAW', "Draw", "Paint the brush's colour", 'BRUSH_DATA', 0),
    ('SOFTEN', "Soften", "Blur, or sharpen with Ctrl", 'MATFLUID', 1),
    ('SMEAR', "Smear", "Push the skin along", 'MOD_SMOOTH', 2),
    ('CLONE', "Clone", "Copy from the 3D cursor, which Ctrl and a click set", 'DUPLICATE', 3),
    ('BELOW', "Erase", SOURCES['BELOW'], 'LOOP_BACK', 4),
    ('MIRROR', "Other Side", SOURCES['MIRROR'], 'MOD_MIRROR', 5),
    ('FRAME', "Frame", SOURCES['FRAME'], 'IMAGE_DATA', 6),
]


class WILDCAP_OT_layer_add(HeadOperator, bpy.types.Operator):
    """Add a layer over the maps, which stay as they are, and paint on it."""

    bl_idname = "wildcap.layer_add"
    bl_label = "New Layer"

    map: bpy.props.EnumProperty(name="Over", items=MAPS, default='albedo', options={'SKIP_SAVE'})

    def work(self, context):
        item = captures.require(context)
        layer = retouch_edits.add_layer(captures.folder(item), "", self.map)
        layers.choose(item, layer.file)
        try:
            session.begin_painting(
                context, item, False, session.LAYER, layer.file, int(context.scene.wildcap.layer_side)
            )
        except Problem:
            retouch_edits.remove_layer(captures.folder(item), layer.file)
            layers.show(item)
            raise


class WILDCAP_OT_layer_paint(CaptureOperator, bpy.types.Operator):
    """Paint on the active layer, on the head or on a flat sheet, with any of Blender's brushes; Ctrl-Z works."""

    bl_idname = "wildcap.layer_paint"
    bl_label = "Paint Layer"
    bl_options = {'REGISTER', 'UNDO'}

    on: bpy.props.EnumProperty(
        name="On",
        items=[('HEAD', "Head", "Paint on the head"), ('SHEET', "Sheet", "Paint on the flat map")],
        default='HEAD',
        options={'SKIP_SAVE'},
    )

    def work(self, context):
        item, painted = captures.require(context), session.layer()
        file = painted.layer.file if painted is not None else layers.require_active(item).file
        side = int(context.scene.wildcap.layer_side)
        session.begin_painting(context, item, self.on == 'SHEET', session.LAYER, file, side)


class LayerPainter(BaseOperator):
    """Operator of the painting of a layer."""

    @classmethod
    def poll(cls, context):
        return cls.allowed(
            session.layer() is not None, "No layer is being painted: click On the Head, under Retouch, first"
        )


class WILDCAP_OT_layer_brush(LayerPainter, bpy.types.Operator):
    """Take a brush in hand."""

    bl_idname = "wildcap.layer_brush"
    bl_label = "Brush"

    kind: bpy.props.EnumProperty(name="Brush", items=BRUSHES, default='DRAW', options={'SKIP_SAVE'})

    @classmethod
    def description(cls, context, properties):
        return cls.bl_rna.properties["kind"].enum_items[properties.kind].description

    def work(self, context):
        paint = context.scene.tool_settings.image_paint
        source = session.layer().copy_from(self.kind, session.mask()) if self.kind in SOURCES else None
        ours = bpy.data.brushes.get(CANVAS)
        if ours is None or paint.brush != ours:
            brush.activate(context, CANVAS, 'DRAW')
        brush.set_kind(paint.brush, 'CLONE' if source is not None else self.kind)
        paint.use_clone_layer = source is not None
        paint.clone_image = source
        session.layer().take(self.kind, session.mask())


class WILDCAP_OT_layer_heal(LayerPainter, bpy.types.Operator):
    """Replace what you painted with this brush by skin: the tone around it, and grain from nearby.

    Choose a brush, dab over a spot, then click; strokes from before the brush was chosen stay. Ctrl-Z undoes it.
    """

    bl_idname = "wildcap.layer_heal"
    bl_label = "Heal"

    def work(self, context):
        image = session.mask()
        if bpy.app.version >= (5, 0, 0):  # Blender 5 stores the state before a step, not the one after it
            session.push_undo(context)
        session.layer().heal(image)
        session.push_undo(context)


class WILDCAP_OT_layer_frame(JobOperator, bpy.types.Operator):
    """Unfold a frame of the video, without its light, to copy from; your painting stays."""

    bl_idname = "wildcap.layer_frame"
    bl_label = "Copy From a Frame"

    frame: bpy.props.EnumProperty(name="Frame", items=lambda self, context: frame_items(context))

    @classmethod
    def poll(cls, context):
        painted = session.layer()
        return cls.allowed(
            painted is not None and painted.is_colour, "Paint a layer over the albedo first: frames show colours alone"
        ) and jobs.can_start(cls, context)

    def work(self, context):
        item = captures.require(context)
        if not self.frame:
            raise Problem("This capture has no delit frames.", "They come with your own video, after Reconstruct.")
        request = {"frame": self.frame, "size": int(context.scene.wildcap.layer_side)}
        jobs.start_tool(item, "retouch_frame", then=lambda: session.offer('FRAME'), retouch=request)


_frames: list[tuple[str, str, str]] = []  # Blender does not hold the items' texts


def frame_items(context) -> list[tuple[str, str, str]]:
    """Return the delit frames of the active capture as items of an EnumProperty."""
    item = captures.active(context)
    capture = captures.folder(item) if item is not None else None
    _frames.clear()
    try:
        names = [frame.name for frame in read_frames(capture).records if frame.selected] if capture else []
    except Problem:
        names = []
    there = [name for name in names if (capture.delit / name).with_suffix(".png").is_file()]
    _frames.extend((name, name.rpartition(".")[0], "") for name in there)
    return _frames


class LayerOperator(CaptureOperator):
    """Operator on the active layer."""

    @classmethod
    def poll(cls, context):
        item = captures.active(context)
        return cls.with_capture(context) and cls.allowed(
            bool(layers.active_file(item)) and session.layer() is None,
            "Choose a layer first, and leave its painting",
        )


class WILDCAP_OT_layer_move(LayerOperator, bpy.types.Operator):
    """Lay the layer over the one above it, or under the one below."""

    bl_idname = "wildcap.layer_move"
    bl_label = "Move Layer"

    up: bpy.props.BoolProperty(name="Up", default=True, options={'SKIP_SAVE'})

    def work(self, context):
        item = captures.require(context)
        retouch_edits.move_layer(captures.folder(item), layers.require_active(item).file, 1 if self.up else -1)
        layers.show(item)


class WILDCAP_OT_layer_remove(LayerOperator, Dialog, bpy.types.Operator):
    """Delete the layer; its last picture is kept in mask_history."""

    bl_idname = "wildcap.layer_remove"
    bl_label = "Delete Layer"

    def tell(self):
        layer = layers.require_active(captures.require(bpy.context))
        return (f"The layer {layer.name} is deleted. Its last picture is kept in the capture's mask_history.",)

    def work(self, context):
        item = captures.require(context)
        retouch_edits.remove_layer(captures.folder(item), layers.require_active(item).file)
        layers.show(item)


class WILDCAP_OT_layer_keep(LayerOperator, bpy.types.Operator):
    """Keep the layer as it is over the changed skin, and take the mark away."""

    bl_idname = "wildcap.layer_keep"
    bl_label = "Keep As It Is"

    def work(self, context):
        item = captures.require(context)
        layer_painting.keep_as_it_is(captures.folder(item), layers.require_active(item))


class WILDCAP_OT_layer_import(FileOperator, JobOperator, bpy.types.Operator):
    """Take a picture of another program as a layer: square, in the head's UVs, with alpha."""

    bl_idname = "wildcap.layer_import"
    bl_label = "Import Layer"

    map: bpy.props.EnumProperty(name="Over", items=MAPS, default='albedo')
    filepath: bpy.props.StringProperty(subtype='FILE_PATH')
    filter_glob: bpy.props.StringProperty(default="*.png;*.tif;*.tiff;*.exr;*.psd;*.webp;*.tga", options={'HIDDEN'})

    def work(self, context):
        item = captures.require(context)
        request = {"picture": bpy.path.abspath(self.filepath), "over": self.map}
        jobs.start_tool(item, "retouch_import", then=lambda: layers.show(item), retouch=request)


class WILDCAP_OT_layer_update(JobOperator, bpy.types.Operator):
    """Lay the layers over the 4K maps, and everything that is made of these."""

    bl_idname = "wildcap.layer_update"
    bl_label = "Update Maps"

    def work(self, context):
        layer_update.begin(captures.require(context))


CLASSES = (
    WILDCAP_OT_layer_add,
    WILDCAP_OT_layer_paint,
    WILDCAP_OT_layer_brush,
    WILDCAP_OT_layer_heal,
    WILDCAP_OT_layer_frame,
    WILDCAP_OT_layer_move,
    WILDCAP_OT_layer_remove,
    WILDCAP_OT_layer_keep,
    WILDCAP_OT_layer_import,
    WILDCAP_OT_layer_update,
)

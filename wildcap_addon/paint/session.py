# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Painting session: from the first click to the saved mask or layer, with the artist's state restored.

The session consists of names and values, as an undo replaces every data-block. However the artist leaves (the button,
Tab, opening or saving a file), what was painted is saved in the capture, and within seconds of each stroke, in case
Blender is killed. A .blend saved during painting reopens in it.
"""

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field

import bpy

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from .. import captures, data_blocks, problems
from . import before, brush, keeping, places, sheet
from .layer_painting import LayerPainting
from .mask_painting import MaskPainting

WATCH_S = 0.5
KEEP_UP_S = 3.0
"""Interval of the checks for changes, each of which reads all pixels."""
LAYER = 'LAYER'
after_layers: list[Callable[[str], None]] = []
"""Functions (capture folder) to call when the painting of a layer has ended."""


@dataclass
class Session:
    """What is painted, and the artist's state before."""

    root: str
    scene: str
    head: str
    mask: str  # the painted image
    which: str = 'SHADOW'  # or 'PROTECT', or LAYER
    layer: str = ""  # file of the layer
    side: int = 0  # of the layer, in texels
    faces_sheet: bool = False  # the views show the sheet
    before: dict = field(default_factory=dict)
    brush: dict = field(default_factory=dict)
    looked: float = 0.0  # time of the last check for changes (time.monotonic)
    offered: str = ""  # kind of edit that a worker has prepared
    # size and time of the file as this session wrote it; any other file goes to the history first
    written: tuple = ()

    @property
    def image(self) -> bpy.types.Image | None:
        return bpy.data.images.get(self.mask)


_session: Session | None = None
_painting: MaskPainting | LayerPainting | None = None  # of the session
_ended: Session | None = None  # the last one, as an undo may restore its scene
_saving: keeping.Saving | None = None


def active() -> bool:
    return _session is not None


def on_sheet() -> bool:
    return _session is not None and sheet.is_there()


def painted_kind() -> str:
    """Return what is painted, SHADOW, PROTECT or LAYER; '' for nothing."""
    return _session.which if _session else ""


def layer() -> LayerPainting | None:
    """Return the painted layer; None if none is painted."""
    return _painting if painted_kind() == LAYER else None


def root() -> str:
    """Return the folder of the capture that is painted."""
    return _session.root


def mask() -> bpy.types.Image:
    """Return the painted image. Raises Problem if it is missing."""
    image = _session.image if _session else None
    if image is None:
        raise Problem(
            f"The {_painting.title if _painting else 'mask'} is no longer in this file.",
            f"Leave the painting, and begin it again under {_painting.panel if _painting else 'Masks'}.",
        )
    return image


def offered() -> str:
    """Return the kind of edit that a worker has prepared: PROPOSAL, SNAPPED, or '' for none."""
    return _session.offered if _session else ""


def offer(kind: str) -> None:
    """Offer a prepared edit, if the artist is still painting."""
    if _session is not None:
        _session.offered = kind


def push_undo(context) -> None:
    """Push a step of the mask's own undo.

    Undo ignores pixels that a script writes; an operator that changes nothing, run after them, records them.
    """
    if not bpy.app.background:  # without a window the operator crashes
        with context.temp_override(edit_image=mask()):
            bpy.ops.image.invert(invert_r=False, invert_g=False, invert_b=False, invert_a=False)


def begin_painting(context, item, use_sheet: bool, which: str = 'SHADOW', layer: str = "", side: int = 0) -> None:
    """Enter Texture Paint on the head or the sheet, with a mask, or with the layer of that file and side.

    Raises Problem without head, or without what it is painted over.
    """
    global _session, _painting
    if _session is not None and (_session.which, _session.layer) == (which, layer):
        places.follow_name(_session)
        with brush.keep_active(context):
            places.turn(context, _session, use_sheet)
        return
    end_painting(context)
    capture = captures.folder(item)
    obj = captures.require_head(context, item)
    painting = _make_painting(capture, which, layer, side)
    image = painting.load()
    _session, _painting = (
        Session(
            str(capture.root),
            context.scene.name,
            obj.name,
            image.name,
            which,
            layer,
            side,
            before=before.remember(context, obj),
        ),
        painting,
    )
    before.at_rest(obj)
    painting.set_up(context, image, _session.before["views"])
    try:
        places.enter(context, _session, use_sheet)
        _session.brush = painting.take_brush(context)
    except Exception:
        before.put_back(context, _session.before)
        _session = _painting = None
        raise
    keeping.prepare(image)
    _start_watching()


def _make_painting(capture: Capture, which: str, layer: str, side: int) -> MaskPainting | LayerPainting:
    return LayerPainting(capture, layer, side) if which == LAYER else MaskPainting(capture, which)


def end_painting(context) -> None:
    """Save the painting and restore the artist's state, also if the artist has left Texture Paint by other means."""
    global _ended
    session, painting = _session, _painting
    if session is None:
        return
    save()  # a Problem here leaves the session open, and nothing is lost
    places.follow_name(session)
    # Blender releases a brush only in this mode
    if context.mode != 'PAINT_TEXTURE' and session.head in context.view_layer.objects:
        places.enter(context, session, sheet.is_there())
    brush.restore(context, session.brush)
    painting.keep_look(context, session.before["views"])
    places.leave(context, session)
    before.put_back(context, session.before)
    if session.image is not None:
        painting.discard(session.image)
    forget()
    _ended = session
    if session.which == LAYER:
        for hear in after_layers:
            hear(session.root)


def after_undo(context) -> None:
    """Correct what an undo or redo leaves out: the views, and the end of a painting, which stays as it was."""
    if _ended is not None:
        places.follow_name(_ended)
    if _session is not None and context.mode == 'OBJECT':
        _session.written = ()  # undone past its start: the watch ends it, and the file goes to the history
    elif _session is not None:
        places.face(_session, sheet.is_there())
    elif _ended is not None and context.mode == 'PAINT_TEXTURE':
        active = context.view_layer.objects.active
        if active is not None and active.name in (_ended.head, sheet.NAME):
            places.leave(context, _ended)
            before.put_back(context, _ended.before)


def save() -> None:
    """Write what was painted to the capture if it has changed. Raises Problem if it cannot."""
    wait()
    image = _session.image if _session else None
    if image is not None:
        _session.written = keeping.store_painting(data_blocks.read_pixels(image), _painting, _session.written)


def keep_up(stroking: bool) -> None:
    """Save what has changed every few seconds, but not during a stroke; the main thread only copies the pixels."""
    global _saving
    if _saving is not None and _saving.is_alive():
        return
    try:
        wait()
    except Problem as problem:
        problems.show(_session.root, problem)
    image = _session.image
    if not stroking and image is not None and image.is_dirty and time.monotonic() - _session.looked >= KEEP_UP_S:
        _session.looked = time.monotonic()
        _saving = keeping.Saving(image, _painting, _session.written)


def wait() -> None:
    """Wait for what is being saved in a thread. Raises Problem if it could not be."""
    global _saving
    saving, _saving = _saving, None
    if saving is not None:
        stamp = saving.result()
        if _session is not None:
            _session.written = stamp


def forget() -> None:
    """Drop the session without changing Blender's data, for a file that is being replaced."""
    global _session, _painting, _ended
    _session = _painting = _ended = None
    keeping.forget()


def _start_watching() -> None:
    if not bpy.app.timers.is_registered(_watch):
        bpy.app.timers.register(_watch, first_interval=WATCH_S, persistent=True)


def _watch() -> float | None:
    """Save changes, and end the session once the artist has left Texture Paint by other means."""
    if _session is None:
        return None
    window = next((w for w in bpy.context.window_manager.windows if w.scene.name == _session.scene), None)
    if window is None:
        return WATCH_S
    with bpy.context.temp_override(window=window):
        if bpy.context.mode == 'OBJECT':
            root = _session.root
            try:
                end_painting(bpy.context)
            except Exception as error:  # Blender would drop the timer
                problems.show_error(root, error, "painting")
                return WATCH_S * 4
        else:
            keep_up(any(operator.bl_idname == 'PAINT_OT_image_paint' for operator in window.modal_operators))
    return WATCH_S


def note() -> str:
    """Return the session as JSON, for the file that is being saved; '' for none."""
    return json.dumps(asdict(_session)) if _session else ""


def go_on(text: str) -> None:
    """Continue the session of a note, with the newer painting of file and capture."""
    global _session, _painting
    try:
        _session = Session(**json.loads(text))
        _painting = _make_painting(Capture(_session.root), _session.which, _session.layer, _session.side)
        _painting.refresh(mask())
    except (ValueError, TypeError):  # a note of another version
        forget()
        return
    except Problem as problem:
        problems.show(_session.root, problem)
        forget()
        return
    _session.looked, _session.written = 0.0, ()
    _start_watching()


def save_or_show() -> None:
    """Save the painting; a Problem is shown in the tab."""
    try:
        save()
    except Problem as problem:
        problems.show(_session.root, problem)


def stop() -> None:
    """Save the painting and stop watching."""
    save_or_show()
    forget()
    if bpy.app.timers.is_registered(_watch):
        bpy.app.timers.unregister(_watch)

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A painting session: from Paint Mask to the saved mask, with everything put back as it was.

Its state is names and values, never references: an undo replaces every data-block. However the artist leaves
(the button, Tab, opening or saving a file), the mask reaches the capture's folder, and within seconds of a stroke's end
anyway: Blender may be killed. A .blend that is saved in the middle of it is opened in the middle of it.
"""

import json
import time
from dataclasses import asdict, dataclass, field

import bpy

from ...core.capture import unforeseen
from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from .. import captures, head, problems
from . import before, brush, keeping, mask_image, places, sheet, view

TINTS = {"SHADOW": "shadow_tint", "PROTECT": "protect_tint"}
"""The scene's properties that keep the colour in which a mask is shown."""
WATCH_S = 0.5
KEEP_UP_S = 3.0
"""Between two looks at whether the mask changed; a look costs the reading of its pixels."""


@dataclass
class Session:
    """What is being painted, and what was there before."""

    root: str
    scene: str
    head: str
    mask: str
    which: str = 'SHADOW'  # or 'PROTECT'
    faces_sheet: bool = False  # the views look at the sheet
    before: dict = field(default_factory=dict)
    brush: dict = field(default_factory=dict)
    looked: float = 0.0  # when the mask was last looked at (time.monotonic)
    offered: str = ""  # the kind of edit that a worker has prepared
    # size and time of the mask's file as this session wrote it; another one goes to the history first
    written: tuple = ()


_session: Session | None = None
_ended: Session | None = None  # the last one, for an undo may bring its scene back
_saving: keeping.Saving | None = None


def active() -> bool:
    return _session is not None


def on_sheet() -> bool:
    return _session is not None and sheet.is_there()


def painted_kind() -> str:
    """The mask that is painted: SHADOW or PROTECT; '' for none."""
    return _session.which if _session else ""


def root() -> str:
    """The folder of the capture whose mask is painted."""
    return _session.root


def mask() -> bpy.types.Image:
    """The image that is painted. Raises Problem when it is gone."""
    image = bpy.data.images.get(_session.mask) if _session else None
    if image is None:
        raise Problem(
            "The mask is not in this file any more.",
            "Leave the painting, and click Paint on the Head, under Masks, again.",
        )
    return image


def offered() -> str:
    """What a worker has prepared for a click: PROPOSAL, SNAPPED, or '' for nothing."""
    return _session.offered if _session else ""


def offer(kind: str) -> None:
    """Notes what waits for a click; nobody may be painting any more."""
    if _session is not None:
        _session.offered = kind


def push_undo(context) -> None:
    """A step of the mask's own undo. Pixels written by a script are in no undo step; an operator of Blender's that
    changes nothing, run after them, makes them one among the strokes."""
    if not bpy.app.background:  # without a window the operator crashes, and there is nobody to press Ctrl-Z
        with context.temp_override(edit_image=mask()):
            bpy.ops.image.invert(invert_r=False, invert_g=False, invert_b=False, invert_a=False)


def begin_painting(context, item, use_sheet: bool, mask_kind: str = 'SHADOW') -> None:
    """Enters Texture Paint, the mask as the tinted stencil and the mask brush in hand. Raises Problem without head or
    texture.

    Parameters
    ----------
    context : Blender's
    item : the capture's
    use_sheet : paint on the flat sheet, not on the head
    mask_kind : 'SHADOW' or 'PROTECT'
    """
    global _session
    if _session is not None and _session.which == mask_kind:
        places.follow_name(_session)
        places.turn(context, _session, use_sheet)
        return
    end_painting(context)
    capture = captures.folder(item)
    obj = captures.require_head(context, item)
    texture = head.load_image(capture.texture_png) if capture.texture_png.is_file() else None
    if texture is None:
        raise Problem("This capture has no texture to paint over.", "Click Reconstruct first.")
    image = mask_image.load(capture, mask_kind)
    _session = Session(
        str(capture.root), context.scene.name, obj.name, image.name, mask_kind, before=before.remember(context, obj)
    )
    before.at_rest(obj)
    props, paint = context.scene.wildcap, context.scene.tool_settings.image_paint
    view.set_up(_session.before["views"], props.tint_strength)
    paint.mode = 'IMAGE'
    paint.canvas = texture
    paint.use_stencil_layer = True
    paint.stencil_image = image
    paint.stencil_color = getattr(props, TINTS[mask_kind])
    paint.invert_stencil = False
    try:
        places.enter(context, _session, use_sheet)
        _session.brush = brush.activate(context)
    except Exception:
        before.put_back(context, _session.before)
        _session = None
        raise
    keeping.prepare(image)
    _start_watching()


def end_painting(context) -> None:
    """Saves the mask and puts everything back. Safe to call when the artist has left the mode by other ways."""
    global _ended
    session = _session
    if session is None:
        return
    save()  # a Problem here leaves the session open, and nothing is lost
    places.follow_name(session)
    # only in this mode does Blender let go of a brush
    if context.mode != 'PAINT_TEXTURE' and session.head in context.view_layer.objects:
        places.enter(context, session, sheet.is_there())
    brush.restore(context, session.brush)
    _keep_tint(context)
    places.leave(context, session)
    before.put_back(context, session.before)
    image = bpy.data.images.get(session.mask)
    if image is not None and mask_image.file_of(Capture(session.root), session.which).is_file():
        image.reload()  # from the file, so that Blender does not ask to save it
    elif image is not None:
        bpy.data.images.remove(image)
    forget()
    _ended = session


def after_undo(context) -> None:
    """Undo and redo bring objects and modes back, but not what the views look at, and nothing of a painting that has
    ended: the mask stays as it was left."""
    active = context.view_layer.objects.active
    if _ended is not None:
        places.follow_name(_ended)
    # undone past its start: the watch ends it, and what was saved before goes to the history
    if _session is not None and context.mode == 'OBJECT':
        _session.written = ()
    elif _session is not None:
        places.face(_session, sheet.is_there())
    elif (
        _ended is not None
        and context.mode == 'PAINT_TEXTURE'
        and active is not None
        and active.name in (_ended.head, sheet.NAME)
    ):
        places.leave(context, _ended)
        before.put_back(context, _ended.before)


def _keep_tint(context) -> None:
    """The tint as the artist left it, for the next session."""
    props = context.scene.wildcap
    setattr(props, TINTS[_session.which], context.scene.tool_settings.image_paint.stencil_color)
    props.tint_strength = view.opacity(_session.before["views"]) or props.tint_strength


def save() -> None:
    """Writes the mask to the capture, atomically, if it changed. Raises Problem when it cannot."""
    wait()
    image = bpy.data.images.get(_session.mask) if _session else None
    if image is not None:
        _session.written = keeping.store_painting(
            mask_image.mask_values(image), Capture(_session.root), _session.which, _session.written
        )


def keep_up(stroking: bool) -> None:
    """Saves a mask that was painted on, every few seconds, but not in the middle of a stroke; the main thread reads the
    pixels and no more."""
    global _saving
    if _saving is not None and _saving.is_alive():
        return
    try:
        wait()
    except Problem as problem:
        problems.show(_session.root, problem)
    image = bpy.data.images.get(_session.mask)
    if not stroking and image is not None and image.is_dirty and time.monotonic() - _session.looked >= KEEP_UP_S:
        _session.looked = time.monotonic()
        _saving = keeping.Saving(image, Capture(_session.root), _session.which, _session.written)


def wait() -> None:
    """Waits for a mask that is being saved aside. Raises Problem when it could not be."""
    global _saving
    saving, _saving = _saving, None
    if saving is not None:
        stamp = saving.result()
        if _session is not None:
            _session.written = stamp


def forget() -> None:
    """Drops the session without touching Blender's data, for a file that is being replaced."""
    global _session, _ended
    _session = _ended = None
    keeping.forget()


def _start_watching() -> None:
    if not bpy.app.timers.is_registered(_watch):
        bpy.app.timers.register(_watch, first_interval=WATCH_S, persistent=True)


def _watch() -> float | None:
    """Ends the session when the artist has left Texture Paint by another way."""
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
            except Exception as error:  # nobody is above a timer: without this, Blender would drop it
                problems.show(root, error if isinstance(error, Problem) else unforeseen.explain(error, "painting"))
                return WATCH_S * 4
        else:
            keep_up(any(operator.bl_idname == 'PAINT_OT_image_paint' for operator in window.modal_operators))
    return WATCH_S


def note() -> str:
    """The session as JSON, for the file in which it is saved; '' for none."""
    return json.dumps(asdict(_session)) if _session else ""


def go_on(text: str) -> None:
    """Takes up the session of a note, with the mask that is the newer one of file and capture."""
    global _session
    try:
        _session = Session(**json.loads(text))
        mask_image.refresh(mask(), Capture(_session.root), _session.which)
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
    """As `save`, where nobody can catch a Problem: it is shown in the tab."""
    try:
        save()
    except Problem as problem:
        problems.show(_session.root, problem)


def stop() -> None:
    """Saves the mask and stops watching, for an add-on that leaves."""
    save_or_show()
    forget()
    if bpy.app.timers.is_registered(_watch):
        bpy.app.timers.unregister(_watch)

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin tone of a face: one choice, in the list's item, in the capture and on the heads of the scene.

The item is what the artist edits, and what Ctrl-Z brings back; from there it goes into the capture, which every job and
every copy reads, and onto the heads. What another program or another .blend wrote into the capture comes back here.
Run-time state only, by the capture's folder.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from ..core.capture import tone_choice
from ..core.capture.messages import Problem
from ..core.capture.tone_choice import SolvedTone
from ..core.settings import skin_swatches
from ..core.settings.colour_values import TONE_DECIMALS, Colour, format_skin_tone, parse_skin_tone
from . import captures, colours, problems, toned_picture

viewers: list[Callable[[bpy.types.Object, object, Colour | None], None]] = []
"""Functions (head object, capture, tone in sRGB or None if none was chosen) of rooms that show a tone on a head."""
_solved: dict[str, SolvedTone | None] = {}
_estimates: dict[str, SolvedTone | None] = {}
_finished: dict[str, str] = {}
_stamps: dict[str, tuple[int, int]] = {}  # modification times of the records that were read last
_shown: dict[str, str] = {}  # the choice that the heads show
_is_quiet = False


def text(item) -> str:
    """Return the choice as a setting has it; unchanged, it is the very text that was read, also a swatch's number."""
    if not item.use_skin_tone:
        return "auto"
    current = format_skin_tone(item.skin_tone)
    with suppress(Problem):
        recorded = parse_skin_tone(item.solve.skin_tone)
        recorded = tuple(item.numbered_tone) if isinstance(recorded, int) else recorded
        if recorded is not None and format_skin_tone(recorded) == current:
            return item.solve.skin_tone
    return current


def take(item, choice: str) -> None:
    """Set the item to a choice, without handing it on."""
    parsed = parse_skin_tone(choice)
    with quiet():
        item.solve.skin_tone, item.use_skin_tone = choice, parsed is not None
        if isinstance(parsed, int):
            parsed = item.numbered_tone = skin_swatches.make_swatches(person(item))[parsed - 1]
        item.skin_tone = parsed or item.skin_tone


def person(item) -> Colour | None:
    """Return the tone that the filmed hue is taken from: the estimate, or the solved one; None before there is any."""
    tone, estimated = _solved.get(captures.root(item)), estimate(item)
    if estimated is not None:
        return estimated[0]
    return None if tone is None else tone.estimate or tone.solved


def estimate(item) -> tuple[Colour, float] | None:
    """Return the estimate and its deviation of L*: of Estimate, until another solve made one; else of the stages."""
    root = captures.root(item)
    estimated = tuple(round(v, 6) for v in item.estimated_tone)
    if all(estimated) and item.estimated_after == solve_time(root):
        return estimated, item.tone_deviation
    of_stages = _estimates.get(root)
    return None if of_stages is None else (of_stages.estimate, of_stages.deviation)


def solve_time(root: str) -> str:
    """Return when the capture's solve was finished, '' without any."""
    return _finished.get(root, "")


def current(item) -> Colour | None:
    """Return the tone that the head is to have, chosen or estimated; None before there is any."""
    return tuple(item.skin_tone) if item.use_skin_tone else person(item)


def asks(item) -> bool:
    """Return whether the estimate spans more than three swatches, and nobody has chosen one."""
    estimated, of_stages = estimate(item), _estimates.get(captures.root(item))
    if item.use_skin_tone or estimated is None:
        return False
    by_stages = of_stages is not None and estimated[0] == of_stages.estimate
    return tone_choice.is_open(estimated[1], of_stages.source if by_stages else item.tone_source)


def warmth(item) -> float:
    """Return by how many deviations the tone is warmer than filmed."""
    tone = current(item)
    return 0.0 if tone is None else round(skin_swatches.find_warmth(tone, person(item)), 1) + 0.0  # no -0.0


def set_warmth(item, value: float) -> None:
    """Choose a tone of the same lightness that is warmer than filmed by so many deviations."""
    tone = current(item) or skin_swatches.make_swatches()[4]
    choose(item, skin_swatches.make_warmer(tone, value - skin_swatches.find_warmth(tone, person(item))))


def choose(item, tone: Colour) -> None:
    """Choose a tone in sRGB, in the capture and on its heads."""
    with quiet():
        item.skin_tone = tone
        item.use_skin_tone = True
    hand_on(item)


@contextmanager
def quiet() -> Iterator[None]:
    """Set properties of an item without handing the choice on after each."""
    global _is_quiet
    before, _is_quiet = _is_quiet, True
    try:
        yield
    finally:
        _is_quiet = before


def hand_on(item) -> None:
    """Write the item's choice into the capture, and show it on the heads."""
    if _is_quiet or not item.path:
        return
    root, capture = captures.root(item), captures.folder(item)
    try:
        _read_solved(root, capture)
        if capture.json.is_file():  # else the first job takes it along
            tone_choice.write_choice(capture, text(item))
    except Problem as problem:
        problems.show(root, problem)
    _stamps[root] = _stamp(capture)
    if _shown.get(root) != text(item):
        show(item)


def take_in(item) -> bool:
    """Take in what was written into the capture since the last look, and return whether the choice is another one.

    In Object Mode it is shown as well.
    """
    root, capture = captures.root(item), captures.folder(item)
    stamp = _stamp(capture)
    if _stamps.get(root) == stamp:
        return False
    _stamps[root] = stamp
    try:
        _read_solved(root, capture)
        choice = tone_choice.read_choice(capture)
    except Problem as problem:
        problems.show(root, problem)
        return False
    if choice is None or choice == text(item):
        return False
    take(item, choice)
    if bpy.context.mode == 'OBJECT':
        show(item)
    return True


def show(item) -> None:
    """Show the choice on the capture's heads."""
    root, capture = captures.root(item), captures.folder(item)
    chosen = tuple(item.skin_tone) if item.use_skin_tone else None
    for head in {each.head for each in captures.of_root(root) if each.head is not None}:
        for view in viewers:
            view(head, capture, chosen)
    _shown[root] = text(item)


def of_maps(capture) -> SolvedTone | None:
    """Return the tone of the solved maps, measured if it is not on record; None without any. Raises Problem."""
    tone = tone_choice.read_solved_tone(capture.read())
    albedo = capture.maps / toned_picture.ALBEDO
    if tone is None and albedo.is_file():
        try:
            mean = colours.linear_to_srgb(toned_picture.mean_of_skin(albedo))
        except Problem:  # a damaged map is told where it is used
            return None
        tone = SolvedTone(tuple(round(float(v), TONE_DECIMALS) for v in mean), None, None, tone_choice.MEASURED)
    return tone


def show_on(head: bpy.types.Object, capture) -> None:
    """Show the tone of the capture's item on a head that just got another material."""
    for item in captures.of_root(str(capture.root))[:1]:
        take_in(item)  # a terminal that renders has not looked at the capture yet
        with suppress(Problem):
            _read_solved(captures.root(item), capture)
        show(item)


def _read_solved(root: str, capture) -> None:
    """Read the tone of the maps; a picture is measured in Object Mode only, as it is a data-block meanwhile."""
    is_free, record = bpy.context.mode == 'OBJECT', capture.read()
    _solved[root] = of_maps(capture) if is_free else tone_choice.read_solved_tone(record)
    _estimates[root] = tone_choice.read_estimate(record)
    _finished[root] = record["stages"].get("solve", {}).get("finished", "")


def _stamp(capture) -> tuple[int, int]:
    return _time(capture.skin_tone), _time(capture.json)


def _time(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


@persistent
def _after_undo(*_) -> None:
    for item in captures.listed():
        hand_on(item)


@persistent
def _after_load(*_) -> None:
    forget()
    for item in captures.listed():
        take_in(item)


def forget() -> None:
    """Forget what was read of captures and shown."""
    for known in (_solved, _estimates, _finished, _stamps, _shown):
        known.clear()


HANDLERS = ("undo_post", _after_undo), ("redo_post", _after_undo), ("load_post", _after_load)


def register():
    skin_swatches.make_swatches()  # reads the scale, which no panel may do while it is drawn
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    forget()

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks that placed the head, as empties on it: the artist corrects them, and the head is fitted again.

Each empty is a child of the head; its own coordinates are those of the capture's world.
"""

import bpy
from mathutils import Vector

from ...core.capture import artist_landmarks
from ...core.capture.capture import Capture
from ...core.capture.json_files import read_json
from ...core.capture.messages import Problem
from ...core.capture.stages import advise_again
from .. import captures, local_view

COLLECTION = "WildCap Landmarks"
INDEX_KEY = "wildcap_landmark"
FOUND_KEY = "wildcap_found"
"""Custom properties of an empty: the landmark's number, and its place when it was shown."""
MOVED_M = 1e-4  # smaller displacements are rounding

# Numbers in MediaPipe's face mesh. Left and right are the person's.
NAMES = {
    33: "Right Eye Outer",
    133: "Right Eye Inner",
    159: "Right Upper Lid",
    145: "Right Lower Lid",
    362: "Left Eye Inner",
    263: "Left Eye Outer",
    386: "Left Upper Lid",
    374: "Left Lower Lid",
    70: "Right Brow Outer",
    105: "Right Brow",
    107: "Right Brow Inner",
    336: "Left Brow Inner",
    334: "Left Brow",
    300: "Left Brow Outer",
    168: "Nose Bridge",
    1: "Nose Tip",
    2: "Nose Base",
    98: "Right Nostril",
    327: "Left Nostril",
    61: "Right Mouth Corner",
    0: "Upper Lip",
    17: "Lower Lip",
    291: "Left Mouth Corner",
    152: "Chin",
    10: "Forehead",
    234: "Right Cheek Bone",
    454: "Left Cheek Bone",
    172: "Right Jaw",
    397: "Left Jaw",
}


def show(context, item) -> int:
    """Show the capture's landmarks on its head, and return how many. Raises Problem if there are none."""
    capture = captures.folder(item)
    head = captures.require_head(context, item)
    points = _known(capture)
    hide(item)
    collection = bpy.data.collections.new(COLLECTION)
    context.scene.collection.children.link(collection)
    for index, name in NAMES.items():
        if index not in points:
            continue
        empty = bpy.data.objects.new(f"{name} Landmark", None)
        empty.empty_display_type, empty.empty_display_size = 'SPHERE', 0.002
        empty.show_in_front = True
        empty.parent = head
        empty.location = points[index]
        empty.lock_rotation = empty.lock_scale = (True, True, True)
        empty[INDEX_KEY], empty[FOUND_KEY], empty[captures.HEAD_KEY] = index, points[index], item.path
        collection.objects.link(empty)
    local_view.join(context, collection.objects)
    return len(collection.objects)


def shown_landmarks(item) -> list[bpy.types.Object]:
    """Return the empties of a list item's head; none for None."""
    return [o for o in bpy.data.objects if INDEX_KEY in o and o.get(captures.HEAD_KEY) == item.path] if item else []


def keep_moved(item) -> int:
    """Store moved landmarks in the capture, where they override those of the frames, and return how many."""
    corrections = {
        o[INDEX_KEY]: tuple(o.location)
        for o in shown_landmarks(item)
        if (o.location - Vector(o[FOUND_KEY])).length > MOVED_M
    }
    if corrections:
        artist_landmarks.put(captures.folder(item), corrections)
    return len(corrections)


def hide(item) -> None:
    """Remove the empties of a list item's head."""
    for empty in shown_landmarks(item):
        bpy.data.objects.remove(empty)
    for collection in [c for c in bpy.data.collections if c.name.startswith(COLLECTION) and not c.all_objects]:
        bpy.data.collections.remove(collection)


def _known(capture: Capture) -> dict[int, list[float]]:
    """Return the landmarks' places, those of the artist over the detected ones."""
    try:
        detected = read_json(capture.landmarks)["points"]
        points = {int(index): [float(v) for v in point] for index, point in detected.items()}
    except FileNotFoundError as error:
        raise Problem(
            "This capture has no landmarks.", "Click Reconstruct first: they are detected in the frames."
        ) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Problem(
            f"{capture.landmarks} cannot be read ({type(error).__name__}: {error}).", advise_again("registration")
        ) from error
    return points | {index: list(point) for index, point in artist_landmarks.read(capture.landmarks_artist).items()}

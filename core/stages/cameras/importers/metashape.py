# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Agisoft Metashape's cameras.xml (File > Export > Export Cameras, format Agisoft XML).

A camera's transform (16 numbers, row by row) takes camera to chunk; camera axes and pixel centres are COLMAP's own. The
chunk's transform (rotation, translation, scale) takes chunk to world. f, cx, cy, b1, b2 in pixels, cx and cy from the
picture's middle; Metashape's p1, p2 are OpenCV's p2, p1. Agisoft Metashape User Manual, appendix "Camera models".
"""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from ....capture.messages import Problem
from ..calibrated import Calibrated, rigid, trailing_number

MOST_SKEW_PX = 1.0  # COLMAP's lens models have none; less is no error that shows


def read(text: str, name: str) -> list[Calibrated]:
    """Read the aligned cameras of the first chunk.

    Raises Problem for other XML, a fisheye lens, or lens parameters that cannot be expressed here.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise Problem(f"{name} is damaged ({error}).", "Export the cameras from Metashape again.") from error
    chunk = root if root.tag == "chunk" else root.find("chunk")
    if root.tag not in ("document", "chunk") or chunk is None or chunk.find("cameras") is None:
        raise Problem(
            f"{name} is XML, but not Metashape's export of cameras.",
            "In Metashape choose File, Export, Export Cameras, format Agisoft XML (*.xml).",
        )
    try:
        sensors = {sensor.get("id"): _lens(sensor, name) for sensor in chunk.iter("sensor")}
        world = _placed(chunk.find("transform"))
        components = {element.get("id"): _placed(element.find("transform")) for element in chunk.iter("component")}
        cameras = []
        for camera in chunk.find("cameras").iter("camera"):
            transform = camera.find("transform")
            if transform is None:
                continue  # not aligned
            matrix = np.array([float(x) for x in transform.text.split()]).reshape(4, 4)
            lens = sensors[camera.get("sensor_id")]
            if lens is None:
                raise Problem(
                    f"{name} has no calibration for the lens of {camera.get('label')}.",
                    "Align the photographs in Metashape, then export the cameras again.",
                )
            place = world if world is not None else components.get(camera.get("component_id"))
            if place is not None:
                scale, rotation, shift = place
                matrix = np.block(
                    [
                        [rotation @ matrix[:3, :3], (scale * rotation @ matrix[:3, 3] + shift)[:, None]],
                        [np.zeros((1, 3)), np.ones((1, 1))],
                    ]
                )
            label = camera.get("label")
            cameras.append(Calibrated(label, trailing_number(label), *lens, *rigid(matrix, label)))
    except (ValueError, KeyError, AttributeError, TypeError) as error:
        raise Problem(
            f"{name} is damaged: a part of it is missing or no number ({error}).",
            "Export the cameras from Metashape again.",
        ) from error
    return cameras


def _lens(sensor, name: str) -> tuple[str, tuple, int, int] | None:
    """Return COLMAP's model and parameters, width and height in pixels; None without a calibration."""
    every = sensor.findall("calibration")
    calibration = next((one for one in every if one.get("class") == "adjusted"), every[0] if every else None)
    if calibration is None:
        return None
    if (calibration.get("type") or sensor.get("type")) != "frame":
        raise Problem(
            f"{name} has a lens of type {calibration.get('type') or sensor.get('type')}, which is not supported.",
            "Photograph with a lens that is not a fisheye, set to type Frame in Metashape's camera calibration.",
        )
    if calibration.find("f") is None:
        raise Problem(
            f"{name} comes from a version of PhotoScan that is too old.",
            "Export the cameras from Metashape 1.5 or newer.",
        )
    size = calibration.find("resolution") if calibration.find("resolution") is not None else sensor.find("resolution")
    width, height = int(size.get("width")), int(size.get("height"))
    value = {
        key: float(calibration.findtext(key, "0"))
        for key in ("f", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4", "b1", "b2")
    }
    if value["k4"] or value["p3"] or value["p4"] or abs(value["b2"]) > MOST_SKEW_PX:
        raise Problem(
            f"{name} has lens parameters (k4, p3, p4 or skew b2) that cannot be expressed here.",
            "In Metashape optimise the cameras with f, cx, cy, k1 to k3, p1, p2 and b1 only, then export again.",
        )
    params = (
        value["f"] + value["b1"],
        value["f"],
        width / 2 + value["cx"],
        height / 2 + value["cy"],
        value["k1"],
        value["k2"],
        value["p2"],
        value["p1"],
        value["k3"],
        0.0,
        0.0,
        0.0,
    )
    return "FULL_OPENCV", params, width, height


def _placed(transform) -> tuple[float, np.ndarray, np.ndarray] | None:
    """Return scale, rotation [3, 3] and translation [3] of a chunk's or component's transform; None without one."""
    if transform is None or transform.find("rotation") is None:
        return None

    def numbers(key: str, default: str) -> np.ndarray:
        return np.array([float(x) for x in transform.findtext(key, default).split()])

    rotation = numbers("rotation", "1 0 0 0 1 0 0 0 1").reshape(3, 3)
    return float(numbers("scale", "1")[0]), rotation, numbers("translation", "0 0 0")

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Imported cameras: known ones written as each program lays them out project known points where that program's own
formula puts them."""

import json
from dataclasses import replace

import numpy as np
import pycolmap
import pytest

from core.capture.frame_records import PHOTOGRAPHS, VIDEO, FrameRecord, Frames
from core.capture.messages import Reporter
from core.imaging import images
from core.stages.cameras.calibration import import_cameras, read_cameras
from core.stages.cameras.importers.realityscan import turned
from research.people import painted_head
from tests.fixtures.refused import refused

WIDTH, HEIGHT = 1200, 1600  # of the pictures the cameras were solved from; the frames are smaller
FRAME_WIDTH, FRAME_HEIGHT = 360, 480
POINTS = np.random.default_rng(0).uniform(-0.07, 0.07, (50, 3))
# tangential as OpenCV's p1, p2
FOCAL, CENTRE, RADIAL, TANGENTIAL = 1900.0, (612.0, 790.0), (-0.06, 0.03, -0.01), (0.002, -0.0015)
VIEWS = [painted_head.place_camera(azimuth, 0.04 * i) for i, azimuth in enumerate((-60, -25, 5, 40))]
NAMES = [f"IMG_{i:04d}" for i in range(7, 11)]


def distorted(local: np.ndarray) -> np.ndarray:
    """Points in the camera [N, 3] -> pixels [N, 2] by the Brown model as OpenCV writes it."""
    x, y = (local[:, :2] / local[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + RADIAL[0] * r2 + RADIAL[1] * r2**2 + RADIAL[2] * r2**3
    p1, p2 = TANGENTIAL
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([FOCAL * u + CENTRE[0], FOCAL * v + CENTRE[1]], 1)


def camera_to_world(view) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = view.rotation.T, view.centre
    return matrix


def metashape_xml() -> str:
    """In a chunk that is turned, moved and ten times as large as the world."""
    rotation = pycolmap.Rotation3d(np.array([0.4, -0.2, 1.1])).matrix()
    scale, shift = 0.1, np.array([0.3, -0.2, 0.5])
    cameras = ""
    for i, (name, view) in enumerate(zip(NAMES, VIEWS, strict=True)):
        world = camera_to_world(view)
        chunk = np.eye(4)
        chunk[:3, :3], chunk[:3, 3] = rotation.T @ world[:3, :3], rotation.T @ (world[:3, 3] - shift) / scale
        cameras += (
            f'<camera id="{i}" sensor_id="0" component_id="0" '
            f'label="{name}"><transform>{" ".join(f"{x:.17g}" for x in chunk.ravel())}</transform>'
            "<orientation>1</orientation></camera>\n"
        )
    k1, k2, k3 = RADIAL
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0"><chunk label="Chunk 1" enabled="true">
<sensors next_id="1"><sensor id="0" label="EOS, 50mm" type="frame"><resolution width="{WIDTH}" height="{HEIGHT}"/>
<property name="layer_index" value="0"/>
<calibration type="frame" class="initial"><resolution width="{WIDTH}" height="{HEIGHT}"/><f>1500</f></calibration>
<calibration type="frame" class="adjusted"><resolution width="{WIDTH}" height="{HEIGHT}"/><f>{FOCAL}</f><cx>{CENTRE[0] - WIDTH / 2}</cx>
<cy>{CENTRE[1] - HEIGHT / 2}</cy><k1>{k1}</k1><k2>{k2}</k2><k3>{k3}</k3><p1>{TANGENTIAL[1]}</p1><p2>{TANGENTIAL[0]}</p2></calibration></sensor></sensors>
<components next_id="1"><component id="0" label="Component 1"><transform><scale>5</scale></transform></component></components>
<cameras next_id="5" next_group_id="0">{cameras}<camera id="4" sensor_id="0" label="not_aligned"/></cameras>
<transform><rotation locked="false">{" ".join(f"{x:.17g}" for x in rotation.ravel())}</rotation>
<translation locked="false">{" ".join(str(x) for x in shift)}</translation><scale locked="false">{scale}</scale></transform>
</chunk></document>"""


def realityscan_csv(header="#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2") -> str:
    lines = [header]
    longer = max(WIDTH, HEIGHT)
    for name, view in zip(NAMES, VIEWS, strict=True):
        # camera to world, looking along -z; = Rz(-heading) Rx(pitch) Ry(roll)
        seen = view.rotation.T @ np.diag([1, -1, -1])
        pitch = np.degrees(np.arcsin(seen[2, 1]))
        heading, roll = np.degrees(np.arctan2(seen[0, 1], seen[1, 1])), np.degrees(np.arctan2(-seen[2, 0], seen[2, 2]))
        middle = (CENTRE[0] - WIDTH / 2) / longer, (CENTRE[1] - HEIGHT / 2) / longer
        values = (*view.centre, heading, pitch, roll, FOCAL / longer * 36, *middle, *RADIAL, 0, *TANGENTIAL[::-1])
        lines.append(f"{name}.JPG," + ",".join(f"{x:.17g}" for x in values))
    return "\n".join(lines) + "\n"


def blender_json() -> str:
    """Without distortion, which Blender's cameras do not have."""
    cameras = []
    for name, view in zip(NAMES, VIEWS, strict=True):
        matrix = camera_to_world(view) @ np.diag([1, -1, -1, 1])
        cameras.append({"name": name, "centre_px": CENTRE, "matrix_world": matrix.tolist()})
    return json.dumps({"width": WIDTH, "height": HEIGHT, "focal_px": FOCAL, "cameras": cameras})


def colmap_model() -> pycolmap.Reconstruction:
    model = pycolmap.Reconstruction()
    params = [FOCAL, FOCAL, *CENTRE, *RADIAL[:2], *TANGENTIAL, RADIAL[2], 0, 0, 0]
    model.add_camera_with_trivial_rig(
        pycolmap.Camera(camera_id=1, model="FULL_OPENCV", width=WIDTH, height=HEIGHT, params=params)
    )
    for i, (name, view) in enumerate(zip(NAMES, VIEWS, strict=True), 1):
        pose = pycolmap.Rigid3d(np.concatenate([view.rotation, view.translation[:, None]], 1))
        model.add_image_with_trivial_frame(pycolmap.Image(name=f"{name}.jpg", camera_id=1, image_id=i), pose)
    return model


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """The frames and their folder, as made from photographs of those names."""
    folder, records = tmp_path_factory.mktemp("frames"), []
    record = FrameRecord(name="", sharpness=1.0, selected=True)
    for i, name in enumerate(NAMES):
        images.write_srgb(folder / f"{i:05d}.jpg", np.zeros((FRAME_HEIGHT, FRAME_WIDTH, 3), np.float32))
        records.append(replace(record, name=f"{i:05d}.jpg", source=f"{name}.jpeg", video_frame=i))
    return Frames(tuple(records), PHOTOGRAPHS), folder


NEWER = "#name,x,y,alt,yaw,pitch,roll,f_35mm,px_norm,py_norm,k1,k2,k3,k4,t1,t2"
FILES = {
    "metashape": ("cameras.xml", metashape_xml()),
    "realityscan": ("cameras.csv", realityscan_csv()),
    "realityscan_2": ("new.csv", realityscan_csv(NEWER)),
    "blender": ("cameras.json", blender_json()),
}


def written(tmp_path, kind: str):
    if kind in FILES:
        name, text = FILES[kind]
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name
    path = tmp_path / "model" / ("sparse/0" if kind == "colmap_bin" else ".")
    path.mkdir(parents=True)
    (colmap_model().write_binary if kind == "colmap_bin" else colmap_model().write_text)(str(path))
    return tmp_path / "model"


@pytest.mark.parametrize("kind", ["colmap_bin", "colmap_txt", *FILES])
def test_known_cameras_come_back_exactly(kind, tmp_path, shot):
    frames, folder = shot
    model = import_cameras(written(tmp_path, kind), frames, folder, Reporter("cameras"))
    assert model.num_reg_images() == 4
    for image in model.images.values():
        view = VIEWS[int(image.name[:5])]
        camera, pose = model.cameras[image.camera_id], image.cam_from_world()
        assert (camera.width, camera.height) == (FRAME_WIDTH, FRAME_HEIGHT)
        there = np.asarray(camera.img_from_cam(POINTS @ pose.rotation.matrix().T + np.asarray(pose.translation)))
        local = POINTS @ view.rotation.T + view.translation
        expected = FOCAL * local[:, :2] / local[:, 2:] + CENTRE if kind == "blender" else distorted(local)
        assert np.abs(there - expected * FRAME_WIDTH / WIDTH).max() < 1e-6
        assert np.allclose(image.projection_center(), view.centre, atol=1e-9)


def test_realityscan_angles_by_hand():
    """Pitch 90: the camera looks level; heading 90 turns it clockwise, from north (+y) to east (+x)."""
    assert np.allclose(turned(0, 90, 0) @ [0, 0, -1], [0, 1, 0], atol=1e-12)
    assert np.allclose(turned(90, 90, 0) @ [0, 0, -1], [1, 0, 0], atol=1e-12)
    assert np.allclose(turned(90, 90, 0) @ [0, 1, 0], [0, 0, 1], atol=1e-12)


def test_a_videos_frames_are_matched_by_number(tmp_path, shot):
    frames, folder = shot
    record = json.loads(blender_json())
    for i, camera in enumerate(record["cameras"]):
        camera["frame"] = i
        del camera["name"]
    (tmp_path / "cameras.json").write_text(json.dumps(record))
    model = import_cameras(tmp_path / "cameras.json", replace(frames, kind=VIDEO), folder, Reporter("cameras"))
    assert model.num_reg_images() == 4


@pytest.mark.parametrize(
    "name, text, says",
    [
        ("a.xml", "<document><chunk>", "damaged"),
        ("a.xml", "<html></html>", "not Metashape"),
        ("a.csv", "a,b,c\n1,2,3\n", "column name is missing"),
        ("a.csv", "#name,x,y,alt,heading,pitch,roll,f\nA.jpg,1,2,three,0,0,0,30\n", "Line 2"),
        ("a.json", "{", "damaged"),
        ("a.json", "{}", "not a list"),
        ("a.json", "[" * 100_000, "damaged"),
        ("a.json", '{"cameras": []}', "no solved camera"),
        ("a.fbx", "", "not a camera file"),
        ("a.csv", "", "column name"),
        ("a.xml", metashape_xml().replace("<k1>", "<k4>0.1</k4><k1>"), "k4"),
        ("a.xml", metashape_xml().replace("adjusted", "x").replace('type="frame"', 'type="fisheye"'), "fisheye"),
        ("a.csv", realityscan_csv().replace(",0,", ",0.2,"), "k4"),
    ],
)
def test_wrong_files_are_refused_with_the_reason(name, text, says, tmp_path):
    (tmp_path / name).write_text(text)
    refused(lambda: read_cameras(tmp_path / name), says)


def test_cameras_of_other_pictures_are_refused(tmp_path, shot):
    frames, folder = shot
    path, turned_folder = written(tmp_path, "realityscan"), tmp_path / "turned"
    path.write_text(path.read_text().replace("IMG", "DSC"))
    words = "0 of the 4 frames", "DSC_0007", "img_0007"
    refused(lambda: import_cameras(path, frames, folder, Reporter("cameras")), *words)
    for record in frames.records:
        images.write_srgb(turned_folder / record.name, np.zeros((FRAME_WIDTH, FRAME_HEIGHT, 3), np.float32))
    path = written(tmp_path, "blender")
    problem = refused(
        lambda: import_cameras(path, frames, turned_folder, Reporter("cameras")), "1200 x 1600", "480 x 360"
    )
    assert "EXIF" in problem.remedy
    refused(lambda: read_cameras(tmp_path / "gone.xml"), "no file or folder")
    refused(lambda: read_cameras(turned_folder), "holds no COLMAP model")
    assert len(read_cameras(written(tmp_path, "colmap_txt") / "images.txt")) == 4  # what a file selector gives


@pytest.mark.parametrize(
    "damage",
    [
        {"width": 0},
        {"height": -5},
        {"width": "1" + "0" * 400},
        {"focal_px": "NaN"},
        {"focal_px": 1e301},
        {"focal_px": 8.3e-317},
        {"frame": "[" * 100_000},
        {"matrix_world": [[1]]},
    ],
    ids=lambda damage: next(iter(damage)),
)
def test_damaged_cameras_are_refused(tmp_path, damage):
    """One damaged byte of a file makes a focal length of 1e-316: finite and positive, and no lens."""
    path, sound = tmp_path / "cameras.json", json.loads(blender_json())
    sound["cameras"][0] = sound["cameras"][0] | damage
    path.write_text(json.dumps(sound), encoding="utf-8")
    refused(lambda: read_cameras(path), "cameras.json")


def test_a_name_may_end_in_any_number_and_a_colmap_lens_of_next_to_nothing_is_refused(tmp_path):
    sound, model = json.loads(blender_json()), colmap_model()
    sound["cameras"][0]["name"] = "a" + "1" * 5000
    (tmp_path / "cameras.json").write_text(json.dumps(sound))
    assert len(read_cameras(tmp_path / "cameras.json")) == len(NAMES)
    model.cameras[1].params = [FOCAL, 1e-9, *model.cameras[1].params[2:]]
    model.write_binary(str(tmp_path))
    refused(lambda: read_cameras(tmp_path), "focal length")

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which frames carry a film's structure, what is matched, and the poses of the frames that are placed by them, against
known ones."""

from itertools import pairwise

import numpy as np
import pycolmap
import pytest

from core.geometry.models import pose_of
from core.imaging import images
from core.stages.cameras import colmap, skeleton
from core.stages.cameras.matches import read_matches
from research.people.painted_head import photograph, place_camera


def film(turns):
    return [(f"{i:05d}.jpg", float((7 * i) % 11), turn) for i, turn in enumerate(turns)]


def test_the_sharpest_frame_of_each_part_is_chosen_in_order():
    frames = film([0.0] * 100)
    chosen = skeleton.choose(frames, 10)
    assert len(chosen) == 10 and chosen == sorted(chosen)
    for part, name in enumerate(chosen):
        there = frames[10 * part : 10 * part + 10]
        assert name == max(there, key=lambda frame: frame[1])[0]
    assert skeleton.choose(frames, 100) == [name for name, _, _ in frames]
    assert skeleton.size(frames[:40]) == 40 and skeleton.size(frames) == skeleton.CARRYING_FRAMES


def test_more_frames_carry_a_film_that_shows_little_and_those_of_fewer_stay():
    frames = [(f"{i:05d}.jpg", float((37 * i) % 101), None) for i in range(333)]
    sizes = [skeleton.size(frames, richness) for richness in (1.0, 0.5, 0.4, 0.2, 0.05, 0.0)]
    assert sizes == [40, 40, 80, 160, 333, 333]
    for few, many in pairwise(sizes):
        assert set(skeleton.choose(frames, few)) <= set(skeleton.choose(frames, many))


def test_every_chosen_frame_is_matched_with_its_neighbours_and_far_ones_at_powers_of_two():
    frames = film([None] * 50)
    names = [name for name, _, _ in frames]
    pairs = skeleton.pairs_within(frames, names)
    assert len(pairs) == len(set(pairs)) and all(first < second for first, second in pairs)
    with_first = {names.index(second) for first, second in pairs if first == names[0]}
    assert with_first == {*range(1, skeleton.NEIGHBOURS + 1), 8, 16, 32}


def test_a_film_that_comes_back_closes_its_loop():
    there = np.linspace(-40, 40, 30)
    turns = np.array([*there, *there[::-1]])
    frames = film(turns)
    names = [name for name, _, _ in frames]
    pairs = set(skeleton.pairs_within(frames, names))
    assert (names[5], names[54]) in pairs  # the same side, 49 frames later
    added = [(names.index(a), names.index(b)) for a, b in pairs - set(skeleton.pairs_within(film([None] * 60), names))]
    assert added and np.abs(np.diff(turns[np.array(added)])).max() < skeleton.SAME_SIDE_DEG


def test_every_other_frame_is_matched_with_the_chosen_ones_around_it():
    frames = film([None] * 40)
    chosen = [name for name, _, _ in frames][::10]
    around = {}
    for one, other in skeleton.pairs_between(frames, chosen):
        around.setdefault(other, []).append(one)
    assert set(around) == {name for name, _, _ in frames} - set(chosen)
    assert around["00015.jpg"] == [chosen[0], chosen[1], chosen[2], chosen[3]]
    assert around["00035.jpg"] == [chosen[2], chosen[3]]


@pytest.fixture(scope="module")
def synthesized(tmp_path_factory):
    """A database with matches and the model that it shows, 14 frames."""
    path = tmp_path_factory.mktemp("skeleton") / "database.db"
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig, options.num_points3D = 1, 1, 14, 400
    pycolmap.set_random_seed(3)
    with pycolmap.Database.open(str(path)) as stored:
        model = pycolmap.synthesize_dataset(options, stored)
    return path, model


def with_lenses_of(true) -> pycolmap.Reconstruction:
    model = pycolmap.Reconstruction()
    for lens in true.cameras.values():
        model.add_camera_with_trivial_rig(pycolmap.Camera(lens.todict()))
    return model


def test_frames_that_are_placed_by_the_others_lie_where_they_were(synthesized):
    path, true = synthesized
    images = sorted(true.images.values(), key=lambda image: image.name)
    left_out = images[1::3]
    names = {image.name for image in left_out}
    kept = with_lenses_of(true)
    for image in images:
        if image.name not in names:
            pixels = np.array([point.xy for point in image.points2D])
            seen = pycolmap.Image(name=image.name, camera_id=image.camera_id, image_id=image.image_id, keypoints=pixels)
            kept.add_image_with_trivial_frame(seen, true.images[image.image_id].cam_from_world())
    for point in true.points3D.values():
        elements = [element for element in point.track.elements if element.image_id in kept.images]
        if len(elements) > 1:
            kept.add_point3D(point.xyz, pycolmap.Track(elements), point.color)
    before, said = kept.num_reg_images(), []
    skeleton.place_others(kept, path, [image.name for image in left_out], 0, lambda done, of: said.append((done, of)))
    assert kept.num_reg_images() == before + len(left_out) and said[-1] == (len(left_out), len(left_out))
    placed = {image.name: pose_of(image) for image in kept.images.values()}
    for image in left_out:
        pose = pose_of(true.images[image.image_id])
        assert np.degrees((placed[image.name].rotation.inverse() * pose.rotation).angle()) < 0.01
        assert np.linalg.norm(placed[image.name].translation - pose.translation) < 1e-3
    assert kept.compute_mean_reprojection_error() < 0.1


def test_a_frame_that_shares_too_little_is_left_out(synthesized):
    path, true = synthesized
    empty = with_lenses_of(true)
    skeleton.place_others(empty, path, sorted(image.name for image in true.images.values()), 0, lambda done, of: None)
    assert empty.num_reg_images() == 0


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """Eight pictures of a person before a wall, five degrees from one to the next."""
    folder = tmp_path_factory.mktemp("filmed")
    for i in range(8):
        picture = photograph(place_camera(5 * i - 20, 0.05 * np.sin(i), scale=1.5))
        images.write_srgb(folder / f"{i:05d}.jpg", picture, quality=95)
    return folder


def job_of(folder, work, names, film=()) -> dict:
    return {
        "images": str(folder),
        "groups": [{"names": names, "width": 450, "height": 600, "focal_px": None}],
        "skin": False,
        "photographs": False,
        "zoomed": False,
        "film": film,
        "finer": True,
        "masks": None,
        "seed": 0,
        "database": str(work / "database.db"),
        "output": str(work / "model"),
    }


def solved(folder, work, sharpest_first=True):
    """The bytes of the model that COLMAP's process leaves of a film, by the names of its files, and the names of the
    frames in it."""
    work.mkdir()
    names = sorted(path.name for path in folder.iterdir())
    film = [(name, float(-i if sharpest_first else i), None) for i, name in enumerate(names)]
    assert colmap.reconstruct(job_of(folder, work, names, film))
    model = pycolmap.Reconstruction(str(work / "model"))
    files = {path.name: path.read_bytes() for path in (work / "model").iterdir()}
    return files, sorted(image.name for image in model.images.values() if image.has_pose)


def test_the_order_in_which_features_are_found_changes_no_byte(filmed, tmp_path, monkeypatch):
    """Threads end in any order; here, once as they do, and once from the last picture to the first."""
    monkeypatch.setattr(skeleton, "CARRYING_FRAMES", 5)
    monkeypatch.setattr(colmap, "FILM_FEATURES", 400)  # of which these small pictures have half
    extract, order = pycolmap.extract_features, []

    def backwards(database, folder, names, *more):
        for name in names[::-1]:
            order.append(name)
            extract(database, folder, [name], *more)

    straight, registered = solved(filmed, tmp_path / "straight")
    monkeypatch.setattr(pycolmap, "extract_features", backwards)
    # not set aside: COLMAP's threads for all but the first picture would begin in a thread that gets only time that
    # nobody wants, and would get no other either
    monkeypatch.setattr(colmap, "_aside", lambda function, *arguments: function(*arguments))
    reversed_, _ = solved(filmed, tmp_path / "reversed")
    assert len(registered) == 8 and set(order) == set(registered) and order != sorted(order)
    assert reversed_ == straight


def test_what_lies_beyond_a_chosen_frame_that_is_not_mapped_is_placed_by_those_that_are(filmed, tmp_path, monkeypatch):
    """As at the end of a long film, whose outermost chosen frame shows too little to be mapped."""
    monkeypatch.setattr(skeleton, "CARRYING_FRAMES", 5)
    monkeypatch.setattr(colmap, "FILM_FEATURES", 400)
    monkeypatch.setattr(colmap, "LEAST_CARRIED_SHARE", 0.8)
    map_, chosen = colmap._map, []
    monkeypatch.setattr(colmap, "_map", lambda job, names: chosen.extend(names) or map_(job, names[1:]))
    _, registered = solved(filmed, tmp_path / "work", sharpest_first=False)
    assert chosen[0] == "00001.jpg" and len(registered) == 8
    pairs = read_matches(tmp_path / "work" / "database.db").pairs
    assert {two for one, two in pairs if one == "00000.jpg"} == set(chosen[1:3])


def test_a_second_model_may_take_every_frame_that_the_first_has(tmp_path, monkeypatch):
    """COLMAP lets it take twenty: after a bad first pair the good model had 31 of 40 frames, and the film counted as
    one that needs more."""
    given = []
    monkeypatch.setattr(pycolmap, "incremental_mapping", lambda *arguments, **more: given.append(arguments[3]) or {})
    names = [f"{i:05d}.jpg" for i in range(40)]
    colmap._map(job_of(tmp_path, tmp_path, names), names)
    assert given[0].max_model_overlap >= len(names) and given[0].image_names == names

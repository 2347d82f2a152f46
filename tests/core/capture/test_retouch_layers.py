# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of an artist's layers: order, names, damage; and what makes the retouched maps out of date."""

import json

import pytest

from core.capture import mask_history, retouch_edits, retouch_layers, stages
from core.capture.capture import Capture
from core.capture.newest_maps import find_newest_maps, find_skin_weight
from core.settings.settings import Settings
from tests.fixtures import recorded, standin
from tests.fixtures.refused import refused

RETOUCH, UPSCALE = stages.by_name("retouch"), stages.by_name("upscale")


@pytest.fixture
def capture(tmp_path, monkeypatch) -> Capture:
    """A solved capture with maps at 4K."""
    monkeypatch.setattr("core.capture.freshness.code_key", lambda module: "")
    capture = Capture(standin.make(tmp_path / "a.wildcap"))
    for name in stages.ENLARGED:
        (capture.root / name).parent.mkdir(exist_ok=True)
        (capture.root / name).write_text(name)
    recorded.record(capture, UPSCALE, Settings())
    return capture


def add(capture: Capture, name: str = "Mole", content: bytes = b"1"):
    layer = retouch_edits.add_layer(capture, name, "albedo", (0.5, 0.4, 0.3))
    retouch_layers.picture_of(capture, layer).write_bytes(content)
    return layer


def finish(capture: Capture) -> None:
    """Write and record the stage's outputs."""
    for name in RETOUCH.writes:
        (capture.root / name).parent.mkdir(exist_ok=True)
        (capture.root / name).write_text(name)
    recorded.record(capture, RETOUCH, Settings())


def names(capture: Capture) -> list[str]:
    return [layer.name for layer in retouch_layers.read_layers(capture)]


def test_layers_are_added_moved_renamed_and_removed(capture):
    mole, scar = add(capture), add(capture, "Scar")
    other = add(capture)
    assert names(capture) == ["Mole", "Scar", "Mole.001"] and len({mole.file, scar.file, other.file}) == 3
    retouch_edits.move_layer(capture, mole.file, 1)
    retouch_edits.move_layer(capture, other.file, 5)
    assert names(capture) == ["Scar", "Mole", "Mole.001"]
    assert retouch_edits.change_layer(capture, scar.file, name="Mole", opacity=0.5).name == "Mole.002"
    assert retouch_layers.find_layer(capture, scar.file).opacity == 0.5
    retouch_edits.remove_layer(capture, mole.file)
    assert names(capture) == ["Mole.002", "Mole.001"] and not (capture.retouch / mole.file).exists()
    assert [path.read_bytes() for path in capture.mask_history.iterdir()] == [b"1"]
    refused(lambda: retouch_layers.find_layer(capture, mole.file), mole.file)


def test_a_file_of_somebody_else_is_never_taken_for_a_new_layer(capture):
    capture.retouch.mkdir()
    (capture.retouch / "Mole.png").write_bytes(b"mine")
    layer = retouch_edits.add_layer(capture, "Mole", "albedo")
    assert layer.file != "Mole.png" and (capture.retouch / "Mole.png").read_bytes() == b"mine"


@pytest.mark.parametrize(
    "entry",
    [
        {"file": "../a.png", "name": "a"},
        {"file": "a.jpg", "name": "a"},
        {"file": ".a.png", "name": "a"},
        {"file": "a.png", "name": ""},
        {"file": "a.png", "name": "a", "map": "roughness"},
        {"file": "a.png", "name": "a", "opacity": 2},
        {"file": "a.png", "name": "a", "visible": 1},
        {"file": "a.png", "name": "a", "tone": [0.1, 0.2]},
        {"name": "a"},
        7,
    ],
)
def test_a_damaged_list_is_refused_by_name_and_never_taken_for_none(capture, entry):
    capture.retouch.mkdir()
    capture.retouch_layers.write_text(json.dumps({"layers": [entry]}))
    refused(lambda: retouch_layers.read_layers(capture), "layers.json")
    assert capture.state(RETOUCH, Settings()) == "to do", "the stage is to run, and to refuse it"


def test_without_layers_there_is_nothing_to_do_whatever_there_is_else(capture):
    assert capture.state(RETOUCH, Settings()) == "done"
    retouch_edits.add_layer(capture, "Empty", "albedo")
    assert capture.state(RETOUCH, Settings()) == "done"


@pytest.mark.parametrize(
    ("change", "stale"),
    [
        (lambda capture, layer: None, False),
        (lambda capture, layer: retouch_edits.change_layer(capture, layer.file, name="Other"), False),
        (lambda capture, layer: retouch_layers.below_of(capture, layer).write_bytes(b"small"), False),
        (lambda capture, layer: retouch_edits.add_layer(capture, "Empty", "normal"), False),
        (lambda capture, layer: retouch_edits.change_layer(capture, layer.file, opacity=0.9), True),
        (lambda capture, layer: retouch_edits.change_layer(capture, layer.file, locked=True), True),
        (lambda capture, layer: retouch_edits.change_layer(capture, layer.file, visible=False), True),
        (lambda capture, layer: (capture.retouch / layer.file).write_bytes(b"2"), True),
        (lambda capture, layer: retouch_edits.remove_layer(capture, layer.file), True),
        (lambda capture, layer: retouch_edits.move_layer(capture, layer.file, 1), True),
    ],
)
def test_what_changes_the_composite_makes_it_stale_and_nothing_else(capture, change, stale):
    layer = add(capture)
    add(capture, "Scar", b"3")
    assert capture.state(RETOUCH, Settings()) == "to do"
    finish(capture)
    assert capture.state(RETOUCH, Settings()) == "done"
    change(capture, layer)
    assert capture.state(RETOUCH, Settings()) == ("stale" if stale else "done")


def test_retouched_maps_are_worn_until_there_are_newer_ones_below(capture):
    layer = add(capture)
    assert find_newest_maps(capture)[0].parent == capture.maps_4k
    finish(capture)
    assert find_newest_maps(capture)[0].parent == capture.maps_retouched
    assert find_skin_weight(capture) == capture.skin_weight
    (capture.maps_retouched / "skin_weight.png").write_bytes(b"w")
    assert find_skin_weight(capture).parent == capture.maps_retouched
    (capture.retouch / layer.file).write_bytes(b"2")
    assert find_newest_maps(capture)[0].parent == capture.maps_retouched, "nearer than none"
    (capture.maps_4k / "normal.png").write_text("anew")
    assert find_newest_maps(capture)[0].parent == capture.maps_4k
    (capture.maps_4k / "normal.png").write_text("maps_4k/normal.png")
    retouch_edits.remove_layer(capture, layer.file)
    assert find_newest_maps(capture)[0].parent == capture.maps_4k


def test_what_was_baked_before_there_were_layers_is_out_of_date_with_them(capture):
    transfer = stages.by_name("transfer")
    (capture.root / "delivery").mkdir()
    (capture.root / "delivery" / "delivery.json").write_text("{}")
    recorded.record(capture, transfer, Settings())
    record = capture.read()
    inputs = record["stages"]["transfer"]["inputs"]
    record["stages"]["transfer"]["inputs"] = {n: v for n, v in inputs.items() if not n.startswith("maps_retouched")}
    capture.json.write_text(json.dumps(record))
    assert capture.state(transfer, Settings()) == "done"
    add(capture)
    finish(capture)
    assert capture.state(transfer, Settings()) == "stale"


def test_the_history_of_one_layer_is_not_anothers(capture):
    """Names that go on after the same words, and the masks' own, are counted apart."""
    first = add(capture, "Spot", b"first")
    mask_history.keep(capture, retouch_layers.picture_of(capture, first))
    other = add(capture, "Spot_2", b"other")
    for _ in range(mask_history.KEPT_MASKS + 2):
        mask_history.keep(capture, retouch_layers.picture_of(capture, other))
        mask_history.keep(capture, retouch_layers.picture_of(capture, first), b"later")
    kept = [path.read_bytes() for path in capture.mask_history.iterdir()]
    assert kept.count(b"other") == mask_history.KEPT_MASKS == kept.count(b"later")
    assert retouch_edits.add_layer(capture, "shadow_mask", "albedo").file != "shadow_mask.png"

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files and folders that settings name: those that a stage needs have to be there, others do not count."""

from pathlib import Path

import pytest

from core.capture.hashes import hash_tree
from core.capture.stages import NAMES
from core.settings.setting_paths import check_paths
from core.settings.settings import from_json
from tests.fixtures.refused import refuses


def check(stage: str, **values) -> None:
    check_paths(from_json({stage: values}), NAMES)


@pytest.mark.parametrize(
    "stage, values",
    [
        ("cameras", {"import_from": "gone"}),
        ("registration", {"template": "gone.obj"}),
        ("delight", {"delighter": "folder", "folder": "gone"}),
        ("delight", {"delighter": "folder"}),
        ("delight", {"delighter": "opendelight"}),
        ("delight", {"delighter": "opendelight", "checkpoint": "gone"}),
        ("texture", {"perceptual": 10, "perceptual_network": "gone"}),
        ("shadow_mask", {"softened": "gone"}),
        ("solve", {"prior": "gone"}),
        ("solve", {"together": "gone"}),
    ],
)
def test_what_is_needed_and_missing_is_named(stage, values):
    refuses(f"{stage}.{list(values)[-1] if 'gone' in values.values() else ''}", check, stage, **values)


def test_a_name_that_no_disk_can_hold_is_missing_like_any_other(tmp_path):
    name = str(tmp_path / ("1" * 300))
    refuses("registration.template", check, "registration", template=name)
    assert hash_tree(Path(name)) == ""


def test_what_is_not_used_may_be_missing():
    check("delight", folder="gone", checkpoint="gone")
    check("texture", perceptual_network="gone")
    check_paths(from_json({"solve": {"prior": "gone"}}), ["frames", "cameras"])
    check_paths(from_json({}), NAMES)


def test_a_place_of_another_kind_or_without_what_it_holds_is_refused(tmp_path):
    file = tmp_path / "a.txt"
    file.touch()
    refuses("is not a folder", check, "shadow_mask", softened=str(file))
    refuses(r"no config\.json", check, "solve", prior=str(tmp_path))
    (tmp_path / "config.json").touch()
    (tmp_path / "ckpt.pth").touch()
    check("solve", prior=str(tmp_path))
    refuses("capture", check, "solve", together=str(tmp_path))
    (tmp_path / "capture.json").touch()
    check("solve", together=str(tmp_path))

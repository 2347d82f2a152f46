# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What research.benchmarks.farm judges by: films, twins, and the account of what was begun and killed."""

import json

import av

from core.batch.record import read_batch
from core.batch.state import TO_DO, derive_state
from research.benchmarks import farm_batch
from research.benchmarks.farm_batch import Begun, judge_account


def test_a_farm_is_laid_out_with_twins_and_again(tmp_path):
    farm_batch.code(tmp_path).symlink_to(farm_batch.ROOT)  # the copy of 60 MB, which is kept where there is one
    for _ in range(2):
        farm_batch.lay_out(tmp_path, 6)
    farm, serial = read_batch(tmp_path / "farm"), read_batch(tmp_path / "serial")
    assert [face.name for face in serial.faces] == ["kind0", "kind1", "kind2", "kind3"] and len(farm.faces) == 6
    assert farm.faces[5].source == serial.faces[1].source and farm.faces[5].settings == serial.faces[1].settings
    filmed = {(farm_batch.film(tmp_path, kind), kind) for kind in range(4)}
    assert {(face.source, face.settings["seed"]) for face in serial.faces} == filmed
    assert derive_state(farm, farm.faces[0]).state == TO_DO
    with av.open(str(serial.faces[2].source)) as film:
        assert sum(1 for _ in film.decode(video=0)) == farm_batch.FRAMES
    assert farm_batch.unequal(tmp_path, 6) == []
    (farm.faces[5].root / "maps").mkdir(parents=True)
    (farm.faces[5].root / "maps" / "normal.png").write_bytes(b"another")
    assert farm_batch.unequal(tmp_path, 6) == ["face005/maps/normal.png"]


def test_what_nodes_say_is_paired(tmp_path):
    """A stage that ended, one that was killed and begun again on another node, and a line that was cut off."""
    logs = tmp_path / "farm" / "logs"
    logs.mkdir(parents=True)

    def line(at, pid, stage, finished):
        return json.dumps({"at": at, "face": "f", "stage": stage, "finished": finished, "pid": pid}) + "\n"

    (logs / "a.jsonl").write_text(
        line(1, 7, "frames", False) + line(2, 7, "frames", True) + line(3, 7, "scan", False) + '{"at": 4, "fa'
    )
    (logs / "b.jsonl").write_text(line(5, 8, "scan", False) + line(6, 8, "scan", True))
    assert farm_batch.read_account(tmp_path) == [
        Begun("a", 7, "f", "frames", 1, 2),
        Begun("a", 7, "f", "scan", 3, None),
        Begun("b", 8, "f", "scan", 5, 6),
    ]


def test_what_was_done_twice_or_lost_for_no_reason_is_found():
    fine = [Begun("a", 7, "f", "scan", 3, None), Begun("b", 8, "f", "scan", 5, 6)]
    kill = {"at": 4, "host": "a", "pid": 7}
    assert judge_account(fine, [kill]) == {"stages": 1, "twice": 0, "interrupted": 1, "unexplained": 0}
    for account in ({**kill, "pid": None}, {**kill, "host": None, "pid": None}):
        assert judge_account(fine, [account])["unexplained"] == 0
    for other in ({**kill, "pid": 8}, {**kill, "host": "b"}, {**kill, "at": 2}):
        assert judge_account(fine, [other])["unexplained"] == 1
    assert judge_account([*fine, Begun("a", 9, "f", "scan", 7, 8)], [kill])["twice"] == 1

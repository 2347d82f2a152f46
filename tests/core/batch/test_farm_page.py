# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/farm.md: its tables are what the code has, and its loop for Slurm is run over a stand-in for sbatch."""

import json
import os
import re
import subprocess
import sys

from core.batch.groups import GROUPS
from core.batch.record import read_batch
from core.batch.shots import HEADINGS
from tests.conftest import ROOT
from tests.fixtures import tiny_chain

PAGE = (ROOT / "docs" / "farm.md").read_text(encoding="utf-8")
SBATCH = """#!{python}
import json, os, subprocess, sys
log = os.environ["SBATCH_LOG"]
jobs = [json.loads(line) for line in open(log, encoding="utf-8")] if os.path.exists(log) else []
given = dict(word[2:].split("=", 1) for word in sys.argv[1:] if "=" in word)
kind, _, after = given.get("dependency", "afterok:0").partition(":")
assert kind == "afterok" and 0 <= int(after) <= len(jobs) and "--parsable" in sys.argv, sys.argv
with open(log, "a", encoding="utf-8") as file:
    file.write(json.dumps(dict(name=given["job-name"], after=jobs[int(after) - 1]["name"] if int(after) else "",
                               code=subprocess.run(given["wrap"], shell=True, cwd="/", stdout=subprocess.DEVNULL).returncode)) + "\\n")
print(f"{{len(jobs) + 1}};cluster")
"""


def rows(heading: str) -> list[list[str]]:
    """The cells of the table whose first column is called so."""
    lines = PAGE[PAGE.index(f"| {heading} |") :].partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip(" `*") for cell in line.strip("|").split("|")] for line in lines]


def test_the_tables_are_those_of_the_code():
    assert [row[0] for row in rows("column")] == list(HEADINGS)
    tasks = rows("task")
    assert [row[0] for row in tasks if row[0] != "the gate"] == [group.name for group in GROUPS]
    assert [row[0] for row in tasks if "GPU" in row[2]] == [group.name for group in GROUPS if group.on_device]
    labels = re.findall(
        r"description|key: \"(\w+)\"", (ROOT / "farm" / "flamenco" / "wildcap.js").read_text(encoding="utf-8")
    )
    named = {name.strip().lower().replace(" ", "_") for row in rows("setting") for name in row[0].split(",")}
    assert named == set(filter(None, labels))


def test_the_loop_for_slurm_submits_and_chains_every_task(tmp_path):
    program, films, batch, log = (
        tiny_chain.build(tmp_path / "pro gram"),
        tmp_path / "films",
        tmp_path / "bat ch",
        tmp_path / "log",
    )
    films.mkdir()
    for name in ("Zoë d'Arc", "Bert"):
        (films / f"{name}.mp4").write_text(name, encoding="utf-8")
    assert subprocess.run([sys.executable, program, "batch", "plan", films, batch], capture_output=True).returncode == 0
    for face in read_batch(batch).faces:
        face.capture.claim()
        (face.root / "mood.json").write_text(json.dumps({}))
    sbatch = tmp_path / "bin" / "sbatch"
    sbatch.parent.mkdir()
    sbatch.write_text(SBATCH.format(python=sys.executable), encoding="utf-8")
    sbatch.chmod(0o755)
    loop = re.search(r"```bash\n(.*?)```", PAGE, re.DOTALL)[1]
    loop = loop.replace("python /opt/wildcap/code", f"'{sys.executable}' '{program}'")
    ended = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", loop],
        capture_output=True,
        text=True,
        cwd="/",
        env={
            **os.environ,
            "PATH": f"{sbatch.parent}:{os.environ['PATH']}",
            "BATCH": str(batch),
            "SBATCH_LOG": str(log),
        },
    )
    assert ended.returncode == 0, ended.stderr
    names = [f"{face}.{group.name}" for face in ("Bert", "Zoë d'Arc") for group in GROUPS]
    before = ["" if name.endswith(GROUPS[0].name) else other for name, other in zip(names, ["", *names], strict=False)]
    assert [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()] == [
        {"name": name, "after": after, "code": 0} for name, after in zip(names, before, strict=True)
    ]

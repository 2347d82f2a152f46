# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The loop for Slurm in docs/farm.md, over a stand-in for sbatch that does what it is given."""

import json
import os
import re
import shlex
import subprocess
import sys

from core.batch.groups import GROUPS
from core.batch.record import read_batch
from tests.conftest import ROOT
from tests.fixtures.tiny_batch import core, set_mood

SBATCH = """#!{python}
import json, os, subprocess, sys
given = dict(word[2:].split("=", 1) for word in sys.argv[1:] if "=" in word)
assert "--parsable" in sys.argv
code = subprocess.run(given["wrap"], shell=True, cwd="/", stdout=subprocess.DEVNULL).returncode
with open(os.environ["SBATCH_LOG"], "a+", encoding="utf-8") as log:
    log.write(json.dumps([given["job-name"], given.get("dependency", ""), code]) + "\\n")
    log.seek(0)
    print(f"{{len(log.readlines())}};cluster")
"""


def test_the_loop_for_slurm_submits_and_chains_every_task(code, tmp_path):
    films, batch = tmp_path / "films", tmp_path / "bat ch"
    films.mkdir()
    (films / "Zoë d'Arc.mp4").touch()
    assert core(code, "batch", "plan", films, batch).returncode == 0
    set_mood(read_batch(batch).faces[0].capture, {})
    listed = core(code, "batch", "commands", batch, "--python", "py", "--wildcap", "/opt/wild cap").stdout.splitlines()
    assert len(listed) == len(GROUPS) and shlex.split(listed[0].split("\t")[2])[:2] == ["py", "/opt/wild cap"]
    sbatch = tmp_path / "bin" / "sbatch"
    sbatch.parent.mkdir()
    sbatch.write_text(SBATCH.format(python=sys.executable), encoding="utf-8")
    sbatch.chmod(0o755)
    loop = re.search(r"```bash\n(.*?)```", (ROOT / "docs" / "farm.md").read_text(encoding="utf-8"), re.DOTALL)[1]
    loop = loop.replace("python /opt/wildcap/code", f"'{sys.executable}' '{code}'")
    variables = {"PATH": f"{sbatch.parent}:{os.environ['PATH']}", "BATCH": batch, "SBATCH_LOG": tmp_path / "log"}
    environment = {**os.environ, **{name: str(value) for name, value in variables.items()}}
    ended = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", loop], capture_output=True, text=True, cwd="/", env=environment
    )
    assert ended.returncode == 0, ended.stderr
    submitted = [json.loads(line) for line in (tmp_path / "log").read_text(encoding="utf-8").splitlines()]
    assert [(name, status) for name, _, status in submitted] == [(f"Zoë d'Arc.{group.name}", 0) for group in GROUPS]
    assert [after for _, after, _ in submitted] == ["", "afterok:1", "afterok:2", "afterok:3"]
    assert core(code, "batch", "commands", batch).stdout == "", "every task is done"

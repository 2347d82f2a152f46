# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Disks that cannot be written to, or have gone."""

import errno
import os
import shutil
from pathlib import Path

import pytest

from core.__main__ import main
from core.capture import sample_head
from core.capture.capture import Capture
from core.capture.files import AWAY, replacing, replacing_folder, storage_problem
from core.capture.messages import Problem
from core.worker import read_only
from tests.fixtures import delivered


def contents(folder: Path) -> dict:
    return {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture
def archive(tmp_path, monkeypatch):
    """A finished capture on a disk that is read-only to all who ask."""
    capture = delivered.make(tmp_path / "Zoë et moi.wildcap")
    access = os.access

    def read_only(path, mode):
        return access(path, mode) and not (mode == os.W_OK and Path(path) == capture.root)

    monkeypatch.setattr(os, "access", read_only)
    return capture


def test_a_read_only_capture_is_delivered_elsewhere_and_looked_at_and_nothing_in_it_changes(archive, tmp_path, capsys):
    before = contents(archive.root)
    assert main(["deliver", str(archive.root), "--to", str(tmp_path / "out")]) == 0, capsys.readouterr().err
    assert main(["status", str(archive.root)]) == 0
    assert contents(archive.root) == before
    (folder,) = (tmp_path / "out").iterdir()
    assert folder.name.startswith("Zoe_et_moi_head") and list(folder.glob("*.obj"))
    assert not list((tmp_path / "out").glob(".*"))
    assert not any(path.is_symlink() for path in folder.rglob("*"))


def test_what_stands_in_for_folders_that_nobody_may_write_to_can_be_written_to(archive, tmp_path):
    folders = [archive.root, *(path for path in archive.root.rglob("*") if path.is_dir())]
    assert archive.maps in folders
    for folder in folders:
        folder.chmod(0o555)
    with read_only.stand_in(archive, str(tmp_path / "out")) as copy:
        assert all(path.stat().st_mode & 0o200 for path in (copy.root, copy.maps))
    assert not list((tmp_path / "out").iterdir())


def test_the_sample_head_of_an_installation_that_is_read_only_can_be_worked_on(tmp_path, monkeypatch):
    shipped = tmp_path / "assets" / "sample_head"
    shutil.copytree(sample_head.SHIPPED, shipped)
    shutil.copyfile(sample_head.SHIPPED.parent / "head.obj", shipped.parent / "head.obj")
    for folder in (shipped / "maps", shipped):
        folder.chmod(0o555)
    monkeypatch.setattr(sample_head, "SHIPPED", shipped)
    capture = sample_head.copy_to(tmp_path)
    assert capture.head.is_file() and (capture.maps / "diffuse_albedo.png").is_file()
    assert all(folder.stat().st_mode & 0o200 for folder in (capture.root, capture.maps))


def test_without_another_folder_it_is_refused_by_name(archive, capsys):
    before = contents(archive.root)
    assert main(["deliver", str(archive.root)]) == 2
    said = capsys.readouterr().err
    assert "is read-only" in said and "--to" in said and contents(archive.root) == before


def test_where_links_cannot_be_made_files_are_copied_and_where_nothing_can_it_is_said(archive, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "symlink", lambda *_: (_ for _ in ()).throw(OSError(errno.EPERM, "no links")))
    with read_only.stand_in(archive, str(tmp_path / "out")) as copy:
        assert copy.head.read_bytes() == archive.head.read_bytes() and not copy.head.is_symlink()
    assert not list((tmp_path / "out").iterdir())
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(Problem), read_only.stand_in(archive, str(tmp_path / "file")):
        pass


def test_a_share_on_which_nobody_may_change_modes_takes_files_and_folders(tmp_path, monkeypatch):
    """As one that is mounted by root for everybody: what is written there is root's."""
    capture = Capture(tmp_path / "a.wildcap")
    monkeypatch.setattr(os, "chmod", lambda *_, **__: (_ for _ in ()).throw(PermissionError(errno.EPERM, "not yours")))
    capture.claim()
    with replacing(capture.scan) as temporary:
        temporary.write_text("scan")
    with replacing_folder(capture.frames) as folder:
        (folder / "00000.jpg").write_text("frame")
    assert capture.scan.read_text() == "scan" and (capture.frames / "00000.jpg").read_text() == "frame"


@pytest.mark.parametrize("code", sorted(AWAY))
def test_a_file_server_that_has_gone_is_named(tmp_path, code):
    path = tmp_path / "maps" / "normal.png"
    assert "does not answer" in storage_problem(OSError(code, os.strerror(code), str(path)), path).problem
    with pytest.raises(Problem, match="does not answer.*what was finished is kept"), replacing(path) as temporary:
        raise OSError(code, os.strerror(code), str(temporary))

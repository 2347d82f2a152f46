# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Disks that are read-only, without links or modes, or gone."""

import errno
import os
import shutil
from pathlib import Path

import pytest

from core.__main__ import main
from core.capture import sample_head
from core.capture.capture import Capture
from core.capture.files import AWAY, replacing, replacing_folder
from core.capture.messages import Problem
from core.worker import read_only
from tests.fixtures import delivered


def contents(folder: Path) -> dict:
    return {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in sorted(folder.rglob("*")) if path.is_file()}


def refuse(*_, **__):
    raise PermissionError(errno.EPERM, "refused")


@pytest.fixture
def archive(tmp_path, monkeypatch):
    """A finished capture on a disk that claims to be read-only."""
    capture = delivered.make(tmp_path / "Zoë et moi.wildcap")
    access = os.access

    def read_only(path, mode):
        return access(path, mode) and not (mode == os.W_OK and Path(path) == capture.root)

    monkeypatch.setattr(os, "access", read_only)
    return capture


def test_the_terminal_delivers_a_read_only_capture_elsewhere(archive, tmp_path, capsys):
    before = contents(archive.root)
    assert main(["deliver", str(archive.root)]) == 2
    error = capsys.readouterr().err
    assert "is read-only" in error and "--to" in error
    words = ["--to", str(tmp_path / "out"), "--preset", "unreal", "--pictures", "png16"]
    assert main(["deliver", str(archive.root), *words]) == 0, capsys.readouterr().err
    (folder,) = (tmp_path / "out").iterdir()
    assert capsys.readouterr().out.splitlines()[-1] == str(folder)
    assert {path.name for path in folder.iterdir()} == {
        "Zoe_et_moi.obj",
        "Zoe_et_moi.mtl",
        "provenance.json",
        "textures",
    }
    assert not any(path.is_symlink() for path in folder.rglob("*"))
    assert main(["status", str(archive.root)]) == 0
    assert contents(archive.root) == before


def test_a_stand_in_is_writable_whatever_the_modes_and_a_copy_where_there_are_no_links(archive, tmp_path, monkeypatch):
    for folder in (archive.root, archive.maps):
        folder.chmod(0o555)
    monkeypatch.setattr(os, "symlink", refuse)
    with read_only.stand_in(archive, str(tmp_path / "out")) as copy:
        assert all(path.stat().st_mode & 0o200 for path in (copy.root, copy.maps))
        assert copy.head.read_bytes() == archive.head.read_bytes() and not copy.head.is_symlink()
    assert not list((tmp_path / "out").iterdir())
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(Problem), read_only.stand_in(archive, str(tmp_path / "file")):
        pass


def test_the_sample_head_of_a_read_only_installation_can_be_worked_on(tmp_path, monkeypatch):
    shipped = tmp_path / "assets" / "sample_head"
    shutil.copytree(sample_head.SHIPPED, shipped)
    shutil.copyfile(sample_head.SHIPPED.parent / "head.obj", shipped.parent / "head.obj")
    for folder in (shipped / "maps", shipped):
        folder.chmod(0o555)
    monkeypatch.setattr(sample_head, "SHIPPED", shipped)
    capture = sample_head.copy_to(tmp_path)
    assert capture.head.is_file() and (capture.maps / "diffuse_albedo.png").is_file()
    assert all(folder.stat().st_mode & 0o200 for folder in (capture.root, capture.maps))


def test_a_share_on_which_nobody_may_change_modes_takes_files_and_folders(tmp_path, monkeypatch):
    """A share mounted by root for everybody: what is written there is root's."""
    capture = Capture(tmp_path / "a.wildcap")
    monkeypatch.setattr(os, "chmod", refuse)
    capture.claim()
    with replacing(capture.scan) as temporary:
        temporary.write_text("scan")
    with replacing_folder(capture.frames) as folder:
        (folder / "00000.jpg").write_text("frame")
    assert capture.scan.read_text() == "scan" and (capture.frames / "00000.jpg").read_text() == "frame"


@pytest.mark.parametrize("code", sorted(AWAY))
def test_a_file_server_that_has_gone_is_named(tmp_path, code):
    path = tmp_path / "maps" / "normal.png"
    with pytest.raises(Problem, match="does not answer"), replacing(path) as temporary:
        raise OSError(code, os.strerror(code), str(temporary))

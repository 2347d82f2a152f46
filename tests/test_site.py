# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's own repository: Blender's tool lists it, and an older installation is updated from it, over a server
on this machine."""

import functools
import hashlib
import http.server
import json
import re
import shutil
import subprocess
import sys
import threading
import tomllib
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from tests.fixtures.drawn import Layout  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
TOOL = Path(bpy.utils.system_resource('SCRIPTS')) / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def run(*arguments: str) -> str:
    result = subprocess.run([sys.executable, str(TOOL), *arguments], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout + result.stderr


@pytest.fixture(scope="module")
def sources(tmp_path_factory) -> Path:
    """What the zip is built from, less what is large, so that it is built in a moment."""
    folder = tmp_path_factory.mktemp("sources")
    for name in ("__init__.py", "blender_manifest.toml", "LICENSE"):
        shutil.copyfile(ROOT / name, folder / name)
    shutil.copytree(ROOT / "wildcap_addon", folder / "wildcap_addon", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def publish(sources: Path, site: Path, version: str) -> None:
    """As `make site`, for the sources called a version."""
    manifest = sources / "blender_manifest.toml"
    manifest.write_text(
        re.sub(r'(?m)^version = ".*"', f'version = "{version}"', manifest.read_text(encoding="utf-8")), encoding="utf-8"
    )
    shutil.rmtree(site, ignore_errors=True)
    site.mkdir()
    run("build", "--source-dir", str(sources), "--output-dir", str(site))
    run("server-generate", "--repo-dir", str(site), "--html", "--html-template", str(ROOT / "docs" / "site.html"))


def test_an_older_installation_is_updated_from_our_repository(sources, tmp_path):
    site, local = tmp_path / "site", tmp_path / "extensions"
    local.mkdir()
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(site))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    where = ("--remote-url", f"http://127.0.0.1:{server.server_port}/index.json", "--local-dir", str(local))
    try:
        for version in ("0.1.0", MANIFEST["version"]):
            publish(sources, site, version)
            run("sync", *where)
            run("install", *where, "--blender-version", "4.2.0", "wildcap")
            installed = tomllib.loads((local / "wildcap" / "blender_manifest.toml").read_text(encoding="utf-8"))
            assert installed["version"] == version and (local / "wildcap" / "wildcap_addon" / "__init__.py").is_file()
    finally:
        server.shutdown()
        server.server_close()
    (entry,) = json.loads((site / "index.json").read_text(encoding="utf-8"))["data"]
    archive = site / f"wildcap-{MANIFEST['version']}.zip"
    assert entry["id"] == "wildcap" and entry["license"] == MANIFEST["license"]
    assert entry["archive_hash"] == f"sha256:{hashlib.sha256(archive.read_bytes()).hexdigest()}"
    page = (site / "index.html").read_text(encoding="utf-8")
    link = rf'href="[^"]*{re.escape(archive.name)}\?repository=[^"]*index\.json'
    assert re.search(link, page) and "${" not in page, "the drag brings the repository along"


def test_links_are_shown_once_they_are_set(addon, monkeypatch):
    preferences = addon("preferences")
    for website, reports, shown in (
        ("", "", []),
        ("https://wildcap.example", "", ["Website"]),
        ("", "https://wildcap.example/new", ["Report a Problem"]),
    ):
        monkeypatch.setattr(preferences.links, "WEBSITE", website)
        monkeypatch.setattr(preferences.links, "REPORTS", reports)
        preferences.draw_links(layout := Layout())
        assert [text for text, _ in layout.texts] == shown

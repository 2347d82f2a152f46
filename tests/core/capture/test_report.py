# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""report.html: whole, escaped, and in need of nothing from elsewhere."""

from html.parser import HTMLParser

import numpy as np
import pytest

from core.capture import report, stages
from core.capture.capture import Capture
from core.capture.messages import Problem, Reporter
from core.imaging import images
from core.settings.settings import Settings, from_json


class Page(HTMLParser):
    """The elements of a page, with the texts between them, and whether every element that was opened is closed."""

    VOID = {"meta", "img", "br"}

    def __init__(self, text: str):
        super().__init__()
        self.elements, self.texts, self._open = [], [], []
        self.feed(text)
        assert not self._open

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data.strip())

    def attributes(self, tag: str) -> list[dict]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture
def capture(tmp_path) -> Capture:
    """With frames and cameras done, one with odd figures, and pictures."""
    capture = Capture(tmp_path / "Tom & <Jerry>.wildcap")
    (tmp_path / "a <b>.mp4").write_bytes(b"1")
    capture.set_source(tmp_path / "a <b>.mp4")
    settings = from_json({"cameras": {"features": "skin"}})
    for name in ("frames", "cameras"):
        (capture.root / name).mkdir()
        (capture.root / name / "a").write_bytes(b"1")
        stage = stages.by_name(name)
        figures = {
            "registered_share": 0.96875,
            "lens": ["a", 1.5, None],
            "text": "<script>alert(1)</script>",
            "by_view": {"0001": True},
        }
        capture.finish(stage, capture.conditions(stage, settings), 75.0, settings, figures, "0.2.0")
    grey = np.full((8, 8, 3), 0.5, np.float32)
    images.write_srgb(capture.picture("cameras", "around_the_head"), grey)
    images.write_srgb(capture.renders / "three lights.png", grey)
    return capture


def test_the_page_shows_every_stage_with_state_pictures_and_figures(capture):
    text = _page_text(capture)
    page = Page(text)
    assert [section["id"] for section in page.attributes("section") if "id" in section] == list(stages.ALWAYS)
    states = ["done", "stale"] + ["to-do"] * (len(stages.ALWAYS) - 2)
    shown = [a["class"] for a in page.attributes("small")]
    assert shown == states, "features is auto again, so cameras are out of date"
    texts = {"0.9688", "registered share", "a, 1.5, -", "0001: yes", "skin", "around the head", "three lights"}
    assert texts <= set(page.texts) and any(text.startswith("1 min 15 s, ") for text in page.texts)
    assert "<script>alert(1)</script>" in page.texts, "escaped, and read back as text"
    assert [image["src"].split(";")[0] for image in page.attributes("img")] == ["data:image/jpeg", "data:image/png"]
    assert not {"script", "link", "iframe"} & {tag for tag, _ in page.elements}, "it loads nothing"
    assert all(image["alt"] for image in page.attributes("img")) and "http" not in text and "url(" not in text


def test_a_capture_without_anything_has_a_page_too(tmp_path):
    assert f"0 of {len(stages.ALWAYS)} stages finished" in _page_text(Capture(tmp_path / "new.wildcap"))


def test_findings_of_all_stages_and_what_stopped_it_come_first(capture):
    assert 'id="doctor"' not in _page_text(capture)
    reporter = Reporter("scan")
    reporter.finding("The light <changed>.", "Lock the exposure.", [f"{i:05d}.jpg" for i in range(14)])
    scan = stages.by_name("scan")
    capture.finish(scan, capture.conditions(scan, Settings()), 1.0, Settings(), {}, "0.2.0", reporter.findings)
    capture.stop(
        "cameras",
        Problem("The frames do not fit together.", "Film again."),
        [{"problem": "Too few.", "remedy": "Take more.", "frames": []}],
    )
    problems = [f["problem"] for f in report.findings(capture.read())]
    assert problems == ["The frames do not fit together.", "Too few.", "The light <changed>."]
    text = _page_text(capture)
    assert "The light &lt;changed&gt;." in text and "00011 and 2 more" in text
    assert text.index('id="doctor"') < text.index('id="frames"') and Page(text)
    capture.forget(["cameras"])
    assert [f["problem"] for f in report.findings(capture.read())] == ["The light <changed>."], "begun again"


def _page_text(capture) -> str:
    report.write(capture, Settings())
    return capture.report.read_text(encoding="utf-8")

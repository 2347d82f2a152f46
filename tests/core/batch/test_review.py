# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""review.html: the faces of a batch in the right order, with their pictures, escaped, and in need of nothing from
elsewhere."""

import base64

import numpy as np
import pytest

from core.__main__ import main
from core.batch import review
from core.batch.record import Batch, BatchFace, write_batch
from core.batch.state import DONE, STOPPED, TO_DO, WAITING, FaceState
from core.capture import stages, tone_choice
from core.capture.files import write_json
from core.imaging import images
from core.settings.settings import Settings
from tests.core.capture.test_report import Page
from tests.fixtures.refused import refuses

FINDING = {"problem": "The light <changed>.", "remedy": "Lock the exposure.", "frames": ["1.jpg"]}


def make(root, name: str, findings: int = 0, **figures) -> BatchFace:
    """A face with what these figures (stage_figure=value) say of it."""
    face = BatchFace(name, root / "film.mp4", root / f"{name}.wildcap")
    face.capture.claim()
    for measure in review.MEASURES:
        if measure.label in figures or measure.label == review.FINDINGS:
            stage = stages.by_name(measure.stage or "frames")
            face.capture.finish(
                stage,
                face.capture.conditions(stage, Settings()),
                60.0,
                Settings(),
                {measure.figure: figures.get(measure.label)},
                "0.2.0",
                [FINDING] * findings if stage.name == "frames" else [],
            )
    return face


def order(batch: Batch) -> list[str]:
    return [row.face.name for row in review.write_review(batch)[1]]


@pytest.fixture
def batch(tmp_path) -> Batch:
    """One with the worst landmarks alone, one rather bad in two things, one with findings, one good in everything."""
    root = tmp_path / "R&D <batch> 100%"
    root.mkdir()
    (root / "film.mp4").write_bytes(b"film")
    faces = (
        make(root, "good", Mask=1.0, Landmarks=0.2, Seen=90.0),
        make(root, "bad chin", Mask=2.0, Landmarks=9.0, Seen=89.0),
        make(root, "half", Mask=50.0, Landmarks=0.9, Seen=70.0),
        make(root, "told", findings=2, Mask=1.5, Landmarks=0.3, Seen=88.0),
    )
    write_batch(Batch(root, faces))
    return Batch(root, faces)


def test_a_measure_is_ranked_by_the_share_of_the_others_that_are_better(batch):
    ranks = review.rank(
        [{"Mask": 10.0, "Seen": 90.0}, {"Mask": 10.0, "Seen": 80.0}, {"Mask": 30.0}, {"Mask": 20.0, "Seen": 70.0}]
    )
    assert [own["Mask"] for own in ranks] == [0, 0, 1, pytest.approx(2 / 3)]
    assert [own.get("Seen") for own in ranks] == [0, 0.5, None, 1], (
        "of what is seen, less is riskier; who has none is not compared"
    )
    assert review.rank([{"Mask": 10.0}]) == [{"Mask": 0.0}]


def test_the_worst_measure_decides_and_where_that_is_equal_their_mean(batch):
    assert order(batch) == ["half", "told", "bad chin", "good"], "means of 2/3, 7/12 and 1/2"
    lines = review.list_riskiest(review.write_review(batch)[1])
    assert [line.split("  ")[0] for line in lines] == ["half", "told", "bad chin", "good"]
    assert lines[2].endswith("landmarks 9 mm, worse than all others")
    assert lines[1].endswith("findings 2, worse than all others")
    assert lines[3].endswith("nothing is worse than in the others")


def test_faces_whose_estimated_tone_spans_more_than_three_swatches_come_first_until_one_is_chosen(batch):
    for name, deviation in (("good", 12.0), ("told", 6.0)):
        capture, stage = batch.face(name).capture, stages.by_name("solve")
        figures = {"skin_tone_srgb": [0.5, 0.4, 0.3], "skin_tone_source": "scene", "skin_tone_deviation_l": deviation}
        capture.finish(stage, {"code": "", "inputs": {}}, 1.0, Settings(), figures, "0")
    assert order(batch)[0] == "good"
    page, rows = review.write_review(batch)
    assert "Choose the skin tone" in page.read_text(encoding="utf-8")
    assert review.list_riskiest(rows)[0].endswith("its skin tone waits to be chosen")
    tone_choice.write_choice(batch.face("good").capture, "6")
    assert order(batch)[-1] == "good"


def test_stopped_faces_come_first_then_those_that_wait(batch, monkeypatch):
    states = {
        "good": FaceState(STOPPED, review.GROUPS[0], "It <broke>.", "Mend it."),
        "told": FaceState(WAITING, review.GROUPS[2]),
        "half": FaceState(DONE),
        "bad chin": FaceState(TO_DO, review.GROUPS[1]),
    }
    monkeypatch.setattr(review, "derive_state", lambda batch, face: states[face.name])
    assert order(batch) == ["good", "told", "half", "bad chin"]
    page = Page((batch.root / review.NAME).read_text(encoding="utf-8"))
    assert {"It <broke>.", "Mend it.", "4 min of work; still to do: head, mask, solve, deliver"} <= set(page.texts)
    headings = list(review.HEADINGS.values())
    assert [text for text in page.texts if text in headings] == headings[1:], "no face's tone is open"


def test_the_page_is_escaped_loads_nothing_and_links_where_the_reports_are(batch):
    capture = batch.faces[2].capture
    capture.report.write_text("report", encoding="utf-8")
    strange = BatchFace("<b>", batch.root / "film.mp4", batch.root / "a #1 <i>.wildcap")
    strange.capture.claim()
    strange.capture.report.write_text("report", encoding="utf-8")
    path, _ = review.write_review(Batch(batch.root, (*batch.faces, strange)))
    text = path.read_text(encoding="utf-8")
    page = Page(text)
    tags = {tag for tag, _ in page.elements}
    assert not {"script", "link", "iframe", "b>"} & tags and "http" not in text and "url(" not in text
    assert {"R&D <batch> 100%", "<b>", "The light <changed>.", "Lock the exposure.", "2 findings"} <= set(page.texts)
    links = sorted(a["href"] for a in page.attributes("a"))
    assert links == ["a%20%231%20%3Ci%3E.wildcap/report.html", "half.wildcap/report.html"]


def test_pictures_are_small_and_in_the_page_and_a_damaged_one_is_left_out(batch):
    capture = batch.faces[0].capture
    wide = np.tile(np.linspace(0, 1, 1200, dtype=np.float32)[None, :, None], (400, 1, 3))
    for stage, name in (("registration", "wireframe"), ("solve", "texture_albedo_shading"), ("frames", "selected")):
        images.write_srgb(capture.picture(stage, name), wide)
    images.write_srgb(capture.renders / "sun.png", wide)
    capture.picture("shadow_mask", "proposal").write_bytes(b"no picture")
    images.write_srgb(batch.faces[1].capture.picture("frames", "selected"), wide[:60])
    review.write_review(batch)
    shown = Page((batch.root / review.NAME).read_text(encoding="utf-8")).attributes("img")
    titles = [image["title"] for image in shown]
    told = ["Frames", *(words for _, _, words in review.PICTURES[::2]), "Render"]
    assert titles == told, "the second face has no other yet"
    small = batch.root / "small.jpg"
    for image, size in zip(shown, [(1200, 60), *[(480, 160)] * 3], strict=True):
        small.write_bytes(base64.b64decode(image["src"].removeprefix("data:image/jpeg;base64,")))
        assert images.size(small) == size
    assert abs(images.read_srgb(small) - images.resize(wide, 480, 160)).mean() < 0.01 and small.stat().st_size < 25_000


def test_a_face_that_nothing_is_known_of_and_a_record_that_cannot_be_read_have_their_places(batch):
    new = BatchFace("new", batch.root / "film.mp4", batch.root / "new.wildcap")
    odd = make(batch.root, "odd")
    record = odd.capture.read()
    record["stages"]["frames"]["figures"] = {"masked_percent": "much"}
    record["stages"]["shadow_mask"] = {**record["stages"]["frames"], "figures": {"masked_percent": float("nan")}}
    write_json(odd.capture.json, record)
    torn = BatchFace("torn", batch.root / "film.mp4", batch.root / "torn.wildcap")
    torn.root.mkdir()
    torn.capture.json.write_text("{", encoding="utf-8")
    named = order(Batch(batch.root, (new, *batch.faces, torn, odd)))
    assert named == ["torn", "half", "told", "bad chin", "good", "new", "odd"]
    assert order(Batch(batch.root, ())) == []


def test_the_terminal_tells_the_path_and_the_five_riskiest(batch, capsys):
    write_batch(Batch(batch.root, (*batch.faces, *(make(batch.root, f"more {i}", Mask=0.5) for i in range(4)))))
    assert main(["batch", "review", str(batch.root)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0] == str(batch.root / "review.html") and len(told) == 6 and told[1].startswith("told")
    assert main(["batch", "review", str(batch.root / "none")]) == 2


def test_what_somebody_else_has_put_in_the_pages_place_stays(batch):
    path = review.write_review(batch)[0]
    assert review.write_review(batch)[0] == path, "its own page is written anew"
    path.write_text("<html>my own notes</html>")
    refuses("not a page that WildCap wrote", review.write_review, batch)
    assert path.read_text() == "<html>my own notes</html>"
    path.unlink()
    path.mkdir()
    refuses("review.html", review.write_review, batch)

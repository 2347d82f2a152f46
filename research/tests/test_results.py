# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages of docs/results are the records': what is edited by hand is found."""

import json
import sys

import numpy as np
import pytest

from research.benchmarks import figures, groomed, open_eyes, pages, results
from research.benchmarks.results import comparison, delighters, eyes, geometry, index
from research.benchmarks.results import scan as scan_page
from tests.conftest import ROOT


@pytest.mark.parametrize("name", results.NAMES)
def test_a_page_is_what_the_records_give(name):
    text = (ROOT / "docs" / "results" / f"{name}.md").read_text(encoding="utf-8")
    assert text == results.page(name), "run `make results`"


def test_every_page_is_written_and_in_the_index():
    assert results.strangers() == []
    assert sorted([*(name for group in index.GROUPS.values() for name in group), "index"]) == sorted(results.NAMES)


def test_the_index_is_one_page_and_a_page_says_what_it_shows():
    assert len(results.page("index").splitlines()) <= 75
    assert "\n\nBrows and beards as curves, against people whose every hair is known.\n\n" in results.page("hair")


def test_the_index_counts_who_loses_and_who_is_synthetic():
    gains = {"scan_lamps": -2.0, "scan_below": 0.1, "bearded_below": -0.2, "very_light": -0.1, "light_overcast": 0.3}
    assert index.worse_in_the_picture(gains) == (
        "3 of 5 captures become worse in the picture, among them 1 of the 2 of the one real scan, whose own map holds "
        "light."
    )
    assert index.worse_in_the_picture({"tan": -1.0}) == "1 of 1 captures become worse in the picture."
    solved, delit = (
        {name: {"psnr": psnr} for name, psnr in zip(("tan", "dark", "scan_below", "bearded"), row, strict=True)}
        for row in ((32.0, 34.0, 24.0, 26.0), (30.0, 30.0, 25.0, 25.0))
    )
    people = figures.Figures({"solved": solved, "delit texture": delit})
    assert "adds +3.00 ± 1.00 dB, to the others +0.00 ± 1.00 dB" in index.gains_by_kind(people)
    assert index.the_synthetic(["bearded_below", "light", "scan_below", "very_light"]) == (
        "The others are synthetic: 1 with strands, eyes and a phone's pipeline, 2 bald, by true cameras."
    )


def test_the_comparison_tells_person_by_person_who_is_ahead_and_names_its_best_rival():
    gains = {"tan": 1.14, "very_light": -1.05, "dark": 0.64}
    assert comparison.by_person(gains) == "tan +1.1, dark +0.6, very light -1.1"
    text = " ".join(results.page("comparison").split())
    scan = figures.read_record("comparison")["figures"]["scan"]["raw"]
    rival = max((name for name in scan if name != "wildcap"), key=lambda name: scan[name]["PSNR"])
    assert (
        f"On the head scan ours has {scan['wildcap']['PSNR']:.1f} dB, the best of the others, *{rival}*, "
        f"{scan[rival]['PSNR']:.1f} dB"
    ) in text


def test_what_a_page_calls_the_worst_or_free_is_so_in_its_record():
    def told_by(page, *records):
        return " ".join(" ".join(body for _, body in page.sections(*map(figures.Figures.of, records))).split())

    chain, scan, measured = (
        figures.read_record(name)["figures"] for name in ("whole_chain", "scan_albedo", "geometry")
    )
    chain["rows"]["scan, network"] |= {"true_mask": {"psnr": 31.5, "ssim": 0.9}, "solved": {"psnr": 30.0, "ssim": 0.9}}
    assert "costs 1.50 dB on the scan" in told_by(scan_page, scan, chain, measured)
    scale = figures.read_record("head_scale")["figures"]
    scale["others"]["worst"] = -0.042
    assert "on nine synthetic heads at most 4.2 % off" in told_by(geometry, measured, scale)


def test_the_page_of_the_state_says_whom_the_fitted_lights_weight_was_chosen_on():
    shown, answers = (figures.read_record(name)["figures"] for name in ("state", "delight_answers"))
    people = {person for rows in shown["people"].values() for person in rows}
    chosen_on = {row["person"] for row in answers["rows"].values()}
    assert {person for person in people if not index.is_bald(person)} == people & chosen_on, "else it is not true"
    assert len(people - chosen_on) == 6
    page = (ROOT / "docs" / "results" / "state.md").read_text(encoding="utf-8").replace("\n", " ")
    assert "chosen on these people but the six bald" in page and "[the page of answers](answers.md)" in page


def test_what_survives_the_solve_is_told_of_captures_that_both_records_hold():
    def record(**psnrs):
        rows = {name: {"psnr": psnr} for name, psnr in psnrs.items()}
        return figures.Figures.of(
            {"captures": {name: {"delit texture": row, "solved": row} for name, row in rows.items()}}
        )

    before = record(tan=20.0, tan_below=22.0, scan_below=25.0, scan_leaves=26.0)
    now = record(tan=24.0, tan_below=21.0, scan_leaves=27.0, brown=30.0)
    rows = delighters.paired(before, now)
    assert rows["solved, before"] == {"tan": {"psnr": 21.0}, "scan": {"psnr": 26.0}}
    assert rows["solved"] == {"tan": {"psnr": 22.5}, "scan": {"psnr": 27.0}} == rows["delit texture"]
    text = " ".join(delighters.after_the_solve(before, now).split())
    assert "2 of 3 came nearer to the truth in the picture, from -1.00 dB (`tan_below`) to +4.00 dB (`tan`)" in text
    assert "Means over 2 people" in text and "| solved | **+1.25 ± 0.25** |" in text


def test_the_page_of_hair_says_where_it_falls_short_and_what_strokes_are_worth():
    rows = {
        "bearded": {
            "brows": {"iou": 0.9, "degrees": 11.0, "usual_degrees": 14.0},
            "beard": {"iou": 0.4, "degrees": 31.0, "usual_degrees": 13.0},
        },
        "bald": {"brows": {"iou": 0.8}},
    }
    assert groomed.shortfalls(rows) == (
        "Below the IoU that is wanted: the bearded person's beard (0.40); farther off: the bearded person's beard (31 "
        "degrees). Hair that follows the strokes lies nearer to the true one than the usual directions alone in 1 of 2 "
        "rows."
    )
    assert "wanted: nothing; farther off: nothing" in groomed.shortfalls({"bald": rows["bald"]})


def test_the_page_of_eyes_says_who_is_in_no_mean():
    measured, missed = ({column: value for column in open_eyes.COLUMNS} for value in (0.5, None))
    everybody = {
        f"{name}, {side}": measured for name in ("bearded", "fringed", "stubbled") for side in ("left", "right")
    }
    assert eyes.left_out(everybody) == "", "the fourth person's lids are closed"
    rows = {**everybody, "fringed, left": missed, "fringed, right": missed}
    assert eyes.left_out(rows) == "Taken for closed, and in no mean: fringed."
    del rows["stubbled, left"]
    assert eyes.left_out(rows).endswith("Filmed with open eyes, too, and not measured: stubbled.")


def test_the_true_iris_has_the_hue_that_was_painted():
    """Between pupil and rim, on a ball of the truth's size; a five-hundredth is what the painter adds to all of it."""
    colour = np.array([0.05, 0.024, 0.010])
    true = open_eyes.true_iris({"iris": colour.tolist(), "seed": 4}, 0.0155) - 0.002
    assert np.allclose(true / true[0], colour / colour[0], rtol=0.01) and true[0] == pytest.approx(0.05, rel=0.4)


def test_eyes_that_were_taken_for_closed_are_rows_without_figures(tmp_path):
    for openness, rows in ((0.9, 2), (0.0, 0)):
        (tmp_path / "cameras.json").write_text(json.dumps({"person": {"openness": openness}}), encoding="utf-8")
        found = open_eyes.missed(tmp_path)
        assert len(found) == rows and all(set(row) == set(open_eyes.COLUMNS) for row in found)
    (tmp_path / "cameras.json").write_text('{"person": {"openness": 0.9}}', encoding="utf-8")
    row = open_eyes.missed(tmp_path)[0]
    assert (row["openness"], row["true openness"], row["rim, mm"]) == (0.0, 0.9, None)


def test_a_page_tells_what_its_records_know(tmp_path):
    figures.write_record(tmp_path / "one.json", "demo", "make demo", {"views": 14})
    record = figures.read_record("one", tmp_path)
    told_of = pages.page_text("One", [record], [("", "Words."), ("More", "| a |\n| --- |")])
    assert told_of.startswith(f"{pages.MADE}\n\n# One\n\nMade by `make demo`, commit ")
    assert told_of.endswith("Words.\n\n## More\n\n| a |\n| --- |\n")
    assert record["date"] in told_of and "cores" in " ".join(told_of.split())
    older = pages.made_by([{**record, "date": None, "machine": None, "commit": "abc"}, record])
    assert "- `make demo`, commit abc.\n- `make demo`, commit" in older
    written = tmp_path / "results" / "one.md"
    pages.write_page(written, "One", "make demo", [("", "Words.")])
    assert written.read_text(encoding="utf-8") == pages.page_text("One", [record], [("", "Words.")])


def test_prose_is_laid_out_and_tables_are_left_as_they_are():
    body = pages.prose(
        """
        Words that
        go on.

        - one
          item
        - another
        """,
        "| a |\n| --- |",
    )
    laid_out = "\n\n".join(map(pages.reflow, body.split("\n\n")))
    assert laid_out == "Words that go on.\n\n- one item\n- another\n\n| a |\n| --- |"
    assert max(map(len, pages.reflow("- " + "word " * 60).splitlines())) <= pages.WIDTH


def test_figures_are_attributes_and_a_missing_one_is_named():
    found = figures.Figures.of({"rows": {"a b": {"psnr": 1.5}}})
    assert found.rows["a b"].psnr == 1.5
    with pytest.raises(AttributeError, match="'ssim' among psnr"):
        found.rows["a b"].ssim  # noqa: B018 a look-up is what is tried


def test_pictures_are_made_of_solved_captures_that_the_pages_show(tmp_path):
    for name in ("sample", "dark", "stranger"):
        (tmp_path / f"{name}.wildcap" / "maps").mkdir(parents=True)
        (tmp_path / f"{name}.wildcap" / "maps" / "normal.png").touch()
    (tmp_path / "tan.wildcap").mkdir()
    (tmp_path / "dark" / "maps").mkdir(parents=True)
    made = {
        (command[0], *(part for part in command if part.endswith(("jpg", "maps"))))
        for command in results.pictures(tmp_path)
    }
    teaser, sample, dark = (
        str(ROOT / "docs" / "pictures" / f"{name}.jpg") for name in ("teaser", "gallery_sample", "gallery_dark")
    )
    assert made == {
        ("research.benchmarks.teaser", teaser),
        ("research.benchmarks.gallery", sample),
        ("research.benchmarks.gallery", dark, str(tmp_path / "dark" / "maps")),
    }


def test_the_command_writes_the_pages_and_then_finds_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(results, "ROOT", tmp_path)

    def run(*options):
        monkeypatch.setattr(sys, "argv", ["results", *options])
        return results.main(), capsys.readouterr().err

    code, said = run("--check")
    assert code == 1 and "docs/results/index.md is not" in said
    assert not (tmp_path / "docs" / "results").exists()
    assert run() == (0, "") and run("--check") == (0, "")
    (tmp_path / "docs" / "results" / "stranger.md").touch()
    code, said = run("--check")
    assert code == 1 and "stranger.py" in said

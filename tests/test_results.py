# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results.md and the figures of README and docs come from the benchmarks' records: what is edited by hand is found."""

import re
import sys

import pytest

from benchmarks import figures, results
from benchmarks.placeholders import fill, measures, plain_prose, unmarked
from benchmarks.tied_figures import Tied, differences, read_tied, refreshed
from core.contract.messages import Problem

from .conftest import ROOT

TIED = {tied.path: tied for tied in read_tied(ROOT / "docs" / "tied.in.md")}


def test_the_page_is_what_its_template_and_the_records_give():
    text, _ = results.page(results.DOCS)
    assert (results.DOCS / results.PAGE).read_text(encoding="utf-8") == text, "run `make results`"
    assert results.unmarked_figures(results.DOCS) == [] and results.missing_pictures(text, results.DOCS) == []


@pytest.mark.parametrize("path", TIED)
def test_figures_of_texts_written_by_hand_are_the_records(path):
    assert differences((ROOT / path).read_text(encoding="utf-8"), TIED[path]) == []


def test_any_figure_of_the_readme_that_is_edited_is_found_and_mended():
    text, tied = (ROOT / "README.md").read_text(encoding="utf-8"), TIED["README.md"]
    assert tied.all_figures
    places = [found.start() for figure in {f for line in plain_prose(text).splitlines() for f in measures(line)}
              for found in re.finditer(rf"(?<![\d.]){re.escape(figure)}", text)]
    assert len(places) > 25
    for place in places:
        digit = place + re.search(r"\d", text[place:]).start()
        doctored = text[:digit] + str((int(text[digit]) + 1) % 10) + text[digit + 1:]
        assert differences(doctored, tied), doctored[digit - 30:digit + 30]
        assert refreshed(doctored, tied) == text


@pytest.mark.parametrize("added", ["It takes 5 minutes.", "| ours | 31.2 dB |", "| ours | 0.931 |", "a gain of 2 dB", "done in two hours", "Memory: 3.5 GB"])
def test_a_figure_without_a_record_is_found(added):
    assert differences(f"Words.\n\n{added}\n", Tied("README.md", (), True)) != []
    assert unmarked(added) != [] and differences(added, Tied("README.md", (), False)) == []


def test_a_phrase_that_was_reworded_is_found():
    tied = Tied("a.md", ("solved in 20 s on 2 cores",), True)
    assert refreshed("It was solved in 9 s\non 4 cores.", tied) == "It was solved in 20 s\non 2 cores."
    for text in ("It was solved within 20 s.", "solved in 20 s on 2 cores, solved in 20 s on 2 cores"):
        assert differences(text, tied)
        with pytest.raises(Problem):
            refreshed(text, tied)


@pytest.fixture
def records(tmp_path):
    rows = {"ours": {"psnr": 30.885, "share": 0.834}, "theirs": {"psnr": 28.0, "share": None}}
    figures.write(tmp_path / "figures" / "one.json", "demo", "make demo", {"rows": rows, "views": 14, "name": "leaves"})
    return tmp_path / "figures"


@pytest.mark.parametrize(("text", "filled"), [
    ("{{one.rows.theirs.psnr:.2f}} dB of {{one.views}} views, {{one.name}}", "28.00 dB of 14 views, leaves"),
    ("{{one.rows.ours.psnr - one.rows.theirs.psnr:+.1f}} dB, {{one.rows.ours.psnr / 1000:.3f}}, {{one.rows.ours.share:.0%}}", "+2.9 dB, 0.031, 83 %"),
    ("`{{command one}}` {{= 10 %}}", "`make demo` 10 %"),
    ("{{each one.rows}}| {{.}} | {{.psnr:.1f}} dB | {{.share:.2f}} |", "| ours | 30.9 dB | 0.83 |\n| theirs | 28.0 dB | - |"),
    ("a\n{{section two}}\n{{two.x}}\n{{end}}\nb", "a\nb"),
    ("{{section one}}\n{{one.views}}\n{{end}}", "14")])
def test_marks_are_filled_in(records, text, filled):
    assert fill(text, "page", records)[0] == filled + "\n"


@pytest.mark.parametrize("mark", [
    "{{one.rows.ours.ssim:.2f}}", "{{two.views}}", "{{one.rows.ours.psnr}}", "{{one.rows.ours.psnr:x}}", "{{one.name:.2f}}", "{{one.rows}}",
    "{{one.rows.theirs.share:.2f}}", "{{section one}}", "{{end}}", "see {{table one}}", "{{one.views - one.views - one.views}}"])
def test_a_mark_that_cannot_be_filled_names_its_line(records, mark):
    with pytest.raises(Problem, match="page, line 2"):
        fill(f"words\n{mark}\n", "page", records)


def test_pictures_are_made_of_solved_captures_that_the_page_shows(tmp_path):
    for name in ("sample", "dark", "stranger"):
        (tmp_path / f"{name}.wildcap" / "maps").mkdir(parents=True)
        (tmp_path / f"{name}.wildcap" / "maps" / "normal.png").touch()
    (tmp_path / "tan.wildcap").mkdir()
    (tmp_path / "dark" / "maps").mkdir(parents=True)
    made = {(command[0], *(part for part in command if part.endswith(("jpg", "maps")))) for command in results.pictures(tmp_path)}
    shown = results.DOCS / "pictures"
    assert made == {("benchmarks.teaser", str(shown / "teaser.jpg")), ("benchmarks.gallery", str(shown / "gallery_sample.jpg")),
                    ("benchmarks.gallery", str(shown / "gallery_dark.jpg"), str(tmp_path / "dark" / "maps"))}


def test_the_command_writes_the_page_and_the_readme_and_then_finds_nothing(records, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(results, "ROOT", tmp_path)
    monkeypatch.setattr(results, "DOCS", tmp_path)
    (tmp_path / "results.in.md").write_text("{{one.views}} views\n{{section two}}\n{{table two}}\n{{end}}\n", encoding="utf-8")
    (tmp_path / "tied.in.md").write_text("# README.md: all figures\nit took {{one.rows.theirs.psnr:.0f}} s\n", encoding="utf-8")
    (tmp_path / "README.md").write_text("Here it took 5 s.\n", encoding="utf-8")

    def run(*options):
        monkeypatch.setattr(sys, "argv", ["results", *options])
        return results.main()

    (tmp_path / "results.md").write_text("old\n", encoding="utf-8")
    assert run("--check") == 1 and (tmp_path / "results.md").read_text(encoding="utf-8") == "old\n"
    assert run() == 0 and run("--check") == 0
    assert (tmp_path / "results.md").read_text(encoding="utf-8") == results.MADE + "14 views\n"
    assert (tmp_path / "README.md").read_text(encoding="utf-8") == "Here it took 28 s.\n"
    assert "two.json is missing" in capsys.readouterr().err

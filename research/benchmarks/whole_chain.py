# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which stage costs what: a solved capture's score beside the scores with one stage replaced by the truth or switched
off.

    python -m research.benchmarks.whole_chain CAPTURE TRUTH [--rows NAME ...] [--delighters NAME ...] [--json OUT.json]

CAPTURE has been run from TRUTH/capture.mp4 with the true skin tone; TRUTH is laid out as
research/benchmarks/albedo_score.py says. Prints one JSON:
  chain         the capture's own maps
  solve_off     its texture, scaled to the tone, taken for the albedo
  raw_texture   the same without any delighting: what geometry and light leave
  true_frames   the true albedo frames through the folder delighter: what geometry, texture and solver cost
  true_mask     the true shadow as shadow_mask.png: what the automatic mask costs
  delighters    per delighter that needs nothing of the user's: the chain with it, and its solve_off
  mask          recall and intersection over union of the automatic mask with the true shadow, over texels of the face
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from dataclasses import asdict
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.face import template
from core.imaging import images
from core.settings.settings import Settings, from_json

from .albedo_score import score_capture
from .continued import run_stages
from .controlled_captures import as_albedo
from .figures import write_record
from .people import skin_tone
from .shadow_captures import lifted_truth

ROWS = ("chain", "solve_off", "raw_texture", "true_frames", "true_mask", "mask", "delighters")
DELIGHTERS = ("none", "shading", "network")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("truth", type=Path)
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=ROWS)
    parser.add_argument("--delighters", nargs="+", default=DELIGHTERS, help="of the row delighters")
    parser.add_argument(
        "--json",
        type=Path,
        help="where the table's figures go, such as research/records/whole_chain.json; those of other captures stay",
    )
    arguments = parser.parse_args()
    capture = Capture(arguments.capture.resolve())
    tone = skin_tone(arguments.truth)
    settings = from_json({"solve": {**_solve_settings(capture), "skin_tone": tone}})
    rows = {row: _row(row, capture, arguments.truth, settings) for row in arguments.rows if row != "delighters"}
    if "delighters" in arguments.rows:
        chosen = {name: from_json({"delight": {"delighter": name}}, settings) for name in arguments.delighters}
        rows["delighters"] = {name: _row("delighter", capture, arguments.truth, of) for name, of in chosen.items()}
    print(json.dumps(rows, indent=1))
    if arguments.json:
        write_record(
            arguments.json,
            "whole_chain",
            "python -m research.benchmarks.whole_chain CAPTURE TRUTH --rows chain solve_off true_mask mask delighters",
            _figures(capture, rows),
            keep=True,
        )


def _figures(capture: Capture, rows: dict) -> dict:
    """PSNR and SSIM per "CAPTURE, DELIGHTER" of the texture at the true tone, the solve and the solve with the true
    mask, and the mask's intersection over union; None is what was not run."""
    name, own = capture.root.stem, capture.read()["stages"]["delight"]["figures"]["delighter"]
    chains = {own: (rows.get("solve_off"), rows.get("chain"), rows.get("true_mask"))}
    chains |= {
        delighter: (row["solve_off"], row, chains.get(delighter, (None,))[-1])
        for delighter, row in rows.get("delighters", {}).items()
    }
    found = {}
    for delighter, scores in chains.items():
        cells = {
            column: {figure: score and score["raw"][figure] for figure in ("psnr", "ssim")}
            for column, score in zip(("solve_off", "solved", "true_mask"), scores, strict=True)
        }
        found[f"{name}, {delighter}"] = {"capture": name, "delighter": delighter, **cells}
    return {"rows": found, **({"mask_iou": {name: rows["mask"]["iou"]}} if "mask" in rows else {})}


def _row(row: str, capture: Capture, truth: Path, settings: Settings) -> dict:
    if row == "chain":
        return score_capture(capture, truth)
    with tempfile.TemporaryDirectory() as folder:
        copy = Capture(Path(folder) / "copy.wildcap")
        shutil.copytree(
            capture.root, copy.root, ignore=shutil.ignore_patterns("maps*", "preview", "checkpoints", "renders", "lock")
        )
        copy.shadow_mask.unlink(missing_ok=True)
        if row == "solve_off":
            return _score_texture(copy, truth, settings)
        if row == "raw_texture":
            settings = from_json({"delight": {"delighter": "none"}}, settings)
            run_stages(copy, settings, "delight", "texture")
            return _score_texture(copy, truth, settings)
        if row == "delighter":
            run_stages(copy, settings, "delight", "texture", "shadow_mask", "solve")
            return {**score_capture(copy, truth), "solve_off": _score_texture(copy, truth, settings)}
        if row == "true_frames":
            run_stages(
                copy,
                from_json({"delight": {"delighter": "folder", "folder": str(truth / "albedo")}}, settings),
                "delight",
                "texture",
                "shadow_mask",
                "solve",
            )
            return {**score_capture(copy, truth), "solve_off": _score_texture(copy, truth, settings)}
        shadow, seen = _true_shadow(copy, truth, 512)
        if row == "mask":
            found = images.resize(images.read_mask(copy.shadow_mask_auto), 512, 512) > 0.5
            both = (found & shadow)[seen].sum()
            return {
                "recall": float(both / shadow[seen].sum()),
                "iou": float(both / (found | shadow)[seen].sum()),
                "true_share": float(shadow[seen].mean()),
                "masked_share": float(found[seen].mean()),
            }
        images.write_data(copy.shadow_mask, images.resize(shadow.astype(np.float32), 1024, 1024).clip(0, 1))
        run_stages(copy, settings, "solve")
        return score_capture(copy, truth)


def _score_texture(capture: Capture, truth: Path, settings: Settings) -> dict:
    """The score of the texture whose confident facial skin has been brought to the skin tone."""
    path = capture.root / "texture_as_albedo.png"
    images.write_srgb(path, as_albedo(capture, settings), bits=16)
    return score_capture(capture, truth, texture=path)


def _true_shadow(capture: Capture, truth: Path, size: int) -> tuple[np.ndarray, np.ndarray]:
    """The true shadow in UV and the texels of facial skin that are judged, both bool [size, size]."""
    confidence = images.resize(images.read_data(capture.texture_confidence)[..., 0], size, size)
    return lifted_truth(capture, truth, size), (template.mask("skin", size) > 0.5) & (confidence > 0.1)


def _solve_settings(capture: Capture) -> dict:
    return capture.read()["stages"].get("solve", {}).get("settings", asdict(Settings().solve))


if __name__ == "__main__":
    main()

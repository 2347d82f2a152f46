# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""report.html: one page with a picture and the figures of each stage.

Pictures are embedded and nothing is loaded, so the page can be sent to somebody.
"""

from __future__ import annotations

import base64
from dataclasses import asdict
from html import escape
from pathlib import Path

from .. import __version__
from ..settings.settings import Settings, tooltips
from . import stages
from .capture import Capture
from .files import replacing
from .freshness import STALE, has_work
from .messages import name_some


def write(capture: Capture, settings: Settings) -> None:
    """Write the report; `settings` decide which stages are out of date. Raises Problem if it cannot be written."""
    record = capture.read()
    sections = (
        _section(capture, stage, record["stages"].get(stage.name), settings)
        for stage in stages.STAGES
        if has_work(capture.root, record, stage)
    )
    renders = _pictures(
        sorted(p for p in capture.renders.glob("*") if p.suffix.lower() in (".jpg", ".jpeg", ".png")), "Render"
    )
    page = PAGE.format(
        title=escape(capture.root.stem),
        source=escape(str(capture.source or "")),
        summary=_summary(record),
        style=STYLE,
        doctor=_doctor(record),
        sections="\n".join(sections),
        renders=f"<section><h2>Renders</h2>{renders}</section>" if renders else "",
        version=__version__,
    )
    with replacing(capture.report) as temporary:
        temporary.write_text(page, encoding="utf-8")


def findings(record: dict) -> list[dict]:
    """List the flaws of a capture: [{"stage", "problem", "remedy", "frames", "stopped"}].

    First the problem that stopped the chain, if any, then the findings of the stages in their order.
    """
    stopped = record.get("stopped")
    faults = []
    if stopped:
        faults.append({**{key: stopped[key] for key in ("stage", "problem", "remedy")}, "frames": [], "stopped": True})
    for name in stages.NAMES:
        own = list(record["stages"].get(name, {}).get("findings", []))
        if stopped and stopped["stage"] == name:
            own += stopped["findings"]
        faults += [{"stage": name, **finding, "stopped": False} for finding in own]
    return faults


def _doctor(record: dict) -> str:
    """Return the section on what is wrong with the video and how to film it again."""
    items = "".join(map(_finding, findings(record)))
    return f'<section id="doctor"><h2>What is wrong with this capture</h2><ul>{items}</ul></section>' if items else ""


def _finding(finding: dict) -> str:
    stage = escape(stages.by_name(finding["stage"]).label)
    frames = name_some([Path(name).stem for name in finding["frames"]], 12)
    return (
        f'<li{" class=stopped" if finding["stopped"] else ""}>{escape(finding["problem"])} '
        f'<b>{escape(finding["remedy"])}</b> '
        f'<small>{"Stopped at: " if finding["stopped"] else ""}{stage}'
        f'{f"; frames {escape(frames)}" if frames else ""}</small></li>'
    )


def _summary(record: dict) -> str:
    entries = record["stages"].values()
    count = len({*stages.ALWAYS, *record["stages"]})
    seconds = sum(entry["seconds"] for entry in entries)
    last = max((entry["finished"].replace("T", " ") for entry in entries), default="never")
    return f"{len(entries)} of {count} stages finished in {_duration(seconds)}; last change {escape(last)}"


def _section(capture: Capture, stage: stages.Stage, finished: dict | None, settings: Settings) -> str:
    verdict = capture.verdict(stage, settings)
    words = f"out of date: {verdict.reason()}" if verdict.state == STALE else verdict.reason() or verdict.state
    head = f'<h2>{escape(stage.label)} <small class="{verdict.state.replace(" ", "-")}">{escape(words)}</small></h2>'
    if finished is None:
        return f'<section id="{stage.name}">{head}</section>'
    pictures = _pictures(sorted(capture.pictures.glob(f"{stage.name}_*.jpg")), stage.label, len(stage.name) + 1)
    defaults = asdict(getattr(Settings(), stage.name))
    changed = {name: value for name, value in finished["settings"].items() if defaults.get(name) != value}
    return (
        f'<section id="{stage.name}">{head}<p class="when">{_duration(finished["seconds"])}, '
        f'{escape(finished["finished"].replace("T", " "))}, '
        f'on {escape(finished["device"])}, seed {escape(str(finished["seed"]))}</p>{pictures}'
        + _table("Figures", finished["figures"], {})
        + _table("Settings other than the defaults", changed, tooltips(type(getattr(settings, stage.name))))
        + "</section>"
    )


def _pictures(paths: list[Path], label: str, cut: int = 0) -> str:
    return "".join(
        f'<figure><img loading="lazy" alt="{escape(label)}: {caption}" '
        f'src="{_embedded(path)}"><figcaption>{caption}</figcaption></figure>'
        for path in paths
        for caption in [escape(path.stem[cut:].replace("_", " "))]
    )


def _embedded(path: Path) -> str:
    kind = "png" if path.suffix.lower() == ".png" else "jpeg"
    return f"data:image/{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def _table(title: str, entries: dict, notes: dict) -> str:
    if not entries:
        return ""
    rows = (
        f'<tr title="{escape(notes.get(name, ""))}"><th>{escape(name.replace("_", " "))}</th>'
        f'<td>{_value(value)}</td></tr>'
        for name, value in entries.items()
    )
    return f"<h3>{title}</h3><table>{''.join(rows)}</table>"


def _value(value) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "-"}[value]
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(_value(item) for item in value)
    if isinstance(value, dict):
        return "; ".join(f"{escape(str(name))}: {_value(item)}" for name, item in value.items())
    return escape(str(value))


def _duration(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds < 60 else f"{int(seconds) // 60} min {int(seconds) % 60:02d} s"


STYLE = """
:root { color-scheme: light dark; --ink: #1d1d1f; --paper: #fbfaf8; --faint: #77736c; --line: #dedad3;
  --good: #2e7d4f; --stale: #b06a00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e9e6e1; --paper: #1b1b1d; --faint: #9c978f; --line: #38373a;
  --good: #6fc492; --stale: #e0a458; } }
body { margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 62rem; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, sans-serif; }
h1 { font-size: 1.9rem; margin: 0; } h2 { font-size: 1.25rem; margin: 0 0 .3rem; } h3 { font-size: .85rem;
  color: var(--faint); margin: 1rem 0 .3rem; }
header p, .when, figcaption, footer { color: var(--faint); margin: .2rem 0; font-size: .88rem;
  overflow-wrap: anywhere; }
section { border-top: 1px solid var(--line); padding: 1.3rem 0; margin-top: 1.3rem; }
small { font-size: .78rem; font-weight: 500; color: var(--faint); margin-left: .5rem; }
  small.done { color: var(--good); }
small.stale, small.older { color: var(--stale); }
figure { display: inline-block; margin: .7rem .8rem 0 0; max-width: 100%; vertical-align: top; }
img { max-width: 100%; max-height: 34rem; border-radius: 4px; display: block; }
table { border-collapse: collapse; font-size: .92rem; }
th { font-weight: 400; text-align: left; padding: .18rem 1.6rem .18rem 0; color: var(--faint); vertical-align: top; }
#doctor li { margin: .5rem 0; } #doctor li.stopped { color: var(--stale); } #doctor b { font-weight: 500;
  display: block; }
td { font-variant-numeric: tabular-nums; padding: .18rem 0; }
"""

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title} - WildCap</title>
<style>{style}</style></head>
<body><header><h1>{title}</h1><p>{source}</p><p>{summary}</p></header>
{doctor}
{sections}
{renders}
<footer><p>WildCap for Blender {version}</p></footer></body></html>
"""

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame and style of review.html, for light and dark."""

STYLE = """
:root { color-scheme: light dark; --ink: #1d1d1f; --paper: #fbfaf8; --card: #fff; --faint: #77736c; --line: #dedad3;
  --good: #2e7d4f; --bad: #b3261e;
  --wait: #b06a00; --bar: #9a958c; }
@media (prefers-color-scheme: dark) { :root { --ink: #e9e6e1; --paper: #1b1b1d; --card: #232326; --faint: #9c978f;
  --line: #38373a; --good: #6fc492;
  --bad: #f2857c; --wait: #e0a458; --bar: #7d7970; } }
body { margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 96rem; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.9rem; margin: 0; } h2 { font-size: 1.2rem; margin: 2.2rem 0 .8rem; } h3 { font-size: 1.05rem;
  margin: 0; overflow-wrap: anywhere; }
h2 small { color: var(--faint); font-weight: 500; margin-left: .3rem; }
header p, .when, footer, details { color: var(--faint); margin: .25rem 0; font-size: .85rem; }
  header { max-width: 60rem; }
a { color: inherit; text-decoration-color: var(--line); text-underline-offset: .2em; }
  a:hover { text-decoration-color: currentcolor; }
article { display: grid; grid-template-columns: 21rem 1fr; gap: 1.4rem; background: var(--card);
  border: 1px solid var(--line); border-radius: 8px;
  padding: 1rem 1.1rem; margin: .7rem 0; }
.seen { display: flex; flex-wrap: wrap; gap: .6rem; align-content: flex-start; }
  .seen > * { min-width: min(100%, 13rem); }
img { display: block; width: 100%; border-radius: 4px; }
.badge { display: inline-block; font-size: .75rem; font-weight: 600; padding: .05rem .55rem; border-radius: 1rem;
  border: 1px solid currentcolor;
  color: var(--faint); margin: 0 .35rem .2rem 0; vertical-align: .1em; }
h3 .badge { margin-left: .4rem; } .badge.done { color: var(--good); } .badge.stopped { color: var(--bad); }
  .badge.waiting { color: var(--wait); }
.problem { color: var(--bad); margin: .5rem 0; font-size: .9rem; overflow-wrap: anywhere; }
  .problem b, li b { display: block; font-weight: 500;
  color: var(--ink); }
table { border-collapse: collapse; table-layout: fixed; width: 100%; margin: .5rem 0; font-size: .88rem;
  font-variant-numeric: tabular-nums; }
th { font-weight: 400; text-align: left; color: var(--faint); width: 5.8rem; padding: .1rem 0; }
td { width: 4.6rem; padding: .1rem .8rem .1rem 0; text-align: right; white-space: nowrap; }
td.bar { width: auto; padding-right: 0; } td.bar i { display: block; height: .5rem; min-width: 1px;
  border-radius: 3px; background: var(--bar); }
tr.worst th, tr.worst td { color: var(--ink); font-weight: 600; } tr.worst td.bar i { background: var(--wait); }
details ul { margin: .3rem 0; padding-left: 1.1rem; } details li { margin: .3rem 0; } summary { cursor: pointer; }
@media (max-width: 60rem) { article { grid-template-columns: 1fr; } }
"""

MARK = '<meta name="generator" content="WildCap">'
"""Tells our page from other files of its name."""

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">{mark}<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title} - WildCap</title>
<style>{style}</style></head>
<body><header><h1>{title}</h1><p>{faces}, {time} of work, as of {written}</p><p>{counts}</p>
<p>A bar is as long as the share of the batch's other faces that are better in that measure. A face is as risky as its
  longest bar: which to look at first,
not which is bad.</p></header>
{sections}
<footer><p>WildCap for Blender {version}</p></footer></body></html>
"""

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Put small faults into the product, one at a time, and count those that its tests find.

    python -m research.benchmarks.mutants draw  --out tests/mutants.json [--count 60] [--seed 1]
    python -m research.benchmarks.mutants trace --record tests/mutants.json
    python -m research.benchmarks.mutants run   --record tests/mutants.json [--limit 60]

`draw` picks faults at random: an operator, a comparison, a condition or a number in a function of the product. `trace`
runs the suite once over a copy in which those functions note the tests that enter them. `run` puts in one fault after
another and runs the tests that enter its function, nearest first, until one fails; that one is recorded. A fault is
named by its file, function, kind and position; "code" is the expression it changes, by which a rewritten function is
searched by hand, and "killed_before" the test that found it at commit e5e14778.
"""

import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from core.capture.files import write_json

from .figures import ROOT, command_line

PYTEST = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider")
PRODUCT = ("core", "wildcap_addon")
PAIRS = (
    (ast.Lt, ast.GtE),
    (ast.LtE, ast.Gt),
    (ast.Eq, ast.NotEq),
    (ast.Is, ast.IsNot),
    (ast.In, ast.NotIn),
    (ast.Add, ast.Sub),
    (ast.Mult, ast.Div),
    (ast.And, ast.Or),
)
SWAPS = {**dict(PAIRS), **{other: one for one, other in PAIRS}}
HITS = "WILDCAP_MUTANT_HITS"
"""Variable that names the file in which functions note the tests that enter them."""
NOTE = f"""
def _note_hit(number, noted=set()):
    import os
    test = os.environ.get("PYTEST_CURRENT_TEST", "").split(" ")[0]
    if test and (number, test) not in noted and os.environ.get("{HITS}"):
        noted.add((number, test))
        with open(os.environ["{HITS}"], "a", encoding="utf-8") as file:
            file.write(f"{{number}}\\t{{test}}\\n")
"""


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("step", choices=("draw", "trace", "run"))
    parser.add_argument("--record", "--out", type=Path, required=True)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=int, default=60, help="tests that are run for one fault at most")
    options = parser.parse_args()
    if options.step == "draw":
        write_json(options.record, {"seed": options.seed, "mutants": draw(options.count, options.seed)})
        return
    record = json.loads(options.record.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory(prefix="mutants_") as folder:
        tree = Path(folder) / "tree"
        copy_tree(tree)
        if options.step == "trace":
            trace(record["mutants"], tree)
        else:
            run(record["mutants"], tree, options.limit, lambda: write_json(options.record, record))
    write_json(options.record, record)


def draw(count: int, seed: int) -> list[dict]:
    """Faults drawn at random, at most one for each function."""
    functions = [
        (path.relative_to(ROOT).as_posix(), name, sites)
        for folder in PRODUCT
        for path in sorted((ROOT / folder).rglob("*.py"))
        for name, function in functions_of(ast.parse(path.read_text(encoding="utf-8")))
        if (sites := sites_of(function))
    ]
    rng = random.Random(seed)
    weights = [len(sites) for _, _, sites in functions]
    drawn: dict[tuple, dict] = {}
    while len(drawn) < count:
        file, name, sites = rng.choices(functions, weights)[0]
        position = rng.randrange(len(sites))
        kind = type(sites[position]).__name__
        drawn.setdefault((file, name), {"file": file, "function": name, "kind": kind, "position": position})
    return list(drawn.values())


def functions_of(tree: ast.AST, within: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            name = f"{within}{node.name}"
            if isinstance(node, ast.FunctionDef):
                yield name, node
            yield from functions_of(node, f"{name}.")


def sites_of(function: ast.FunctionDef) -> list[ast.AST]:
    """Return the nodes of a function's own body that a fault can be put into, in a fixed order."""
    found = []
    waiting = list(reversed(function.body))
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.JoinedStr):
            continue
        swapped = (isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS) or (
            isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in SWAPS
        )
        number = isinstance(node, ast.Constant) and type(node.value) in (int, float)
        if swapped or number or isinstance(node, ast.If | ast.IfExp):
            found.append(node)
        waiting += reversed(list(ast.iter_child_nodes(node)))
    return found


def put_fault(text: str, mutant: dict) -> str:
    """Return the source with the fault in it. Raises LookupError where the function has no such place any more."""
    tree = ast.parse(text)
    function = next((node for name, node in functions_of(tree) if name == mutant["function"]), None)
    sites = sites_of(function) if function is not None else []
    if mutant["position"] >= len(sites) or type(sites[mutant["position"]]).__name__ != mutant["kind"]:
        raise LookupError(f"{mutant['file']}: {mutant['function']} has no {mutant['kind']} {mutant['position']}")
    node = sites[mutant["position"]]
    if isinstance(node, ast.Compare):
        node.ops[0] = SWAPS[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp | ast.BoolOp):
        node.op = SWAPS[type(node.op)]()
    elif isinstance(node, ast.Constant):
        node.value = node.value + 1
    else:
        node.test = ast.UnaryOp(ast.Not(), node.test)
    return ast.unparse(ast.fix_missing_locations(tree))


def copy_tree(to: Path) -> None:
    """Copy what git knows, as it is on the disk."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, to / name)
    subprocess.run(["git", "init", "-q"], cwd=to, check=True)
    subprocess.run(["git", "add", "-A"], cwd=to, check=True)


def trace(mutants: list[dict], tree: Path) -> None:
    """Record the tests that enter each fault's function ("entered_by")."""
    by_file: dict[str, list[tuple[int, str]]] = {}
    for number, mutant in enumerate(mutants):
        by_file.setdefault(mutant["file"], []).append((number, mutant["function"]))
    for file, functions in by_file.items():
        parsed = ast.parse((tree / file).read_text(encoding="utf-8"))
        nodes = dict(functions_of(parsed))
        for number, name in functions:
            if name in nodes:
                nodes[name].body.insert(0, ast.parse(f"_note_hit({number})").body[0])
            else:
                print(f"{file} has no {name} any more.")
        # a docstring and imports from __future__ stay first
        first = next(i for i, node in enumerate(parsed.body) if not _opens_a_file(node))
        parsed.body[first:first] = ast.parse(NOTE).body
        (tree / file).write_text(ast.unparse(ast.fix_missing_locations(parsed)), encoding="utf-8")
    hits = tree.parent / "hits.txt"
    command = [*PYTEST, "tests", "--ignore=tests/gui", "-n", "2", "--dist", "loadfile"]
    subprocess.run(command, cwd=tree, env={**os.environ, HITS: str(hits)})
    pairs = {tuple(line.split("\t")) for line in hits.read_text(encoding="utf-8").splitlines()}
    for number, mutant in enumerate(mutants):
        mutant["entered_by"] = sorted(test for index, test in pairs if index == str(number))


def _opens_a_file(node: ast.stmt) -> bool:
    docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return docstring or (isinstance(node, ast.ImportFrom) and node.module == "__future__")


def run(mutants: list[dict], tree: Path, limit: int, keep: Callable[[], None]) -> None:
    """Record the test that finds each fault ("killed_by", None if none does)."""
    for mutant in (mutant for mutant in mutants if "killed_by" not in mutant):
        path = tree / mutant["file"]
        sound = path.read_text(encoding="utf-8")
        path.write_text(put_fault(sound, mutant), encoding="utf-8")
        mutant["killed_by"] = _first_failure(tree, _nearest(mutant)[:limit])
        path.write_text(sound, encoding="utf-8")
        keep()
        print(mutant["file"], mutant["function"], mutant["kind"], mutant["killed_by"], flush=True)


def _nearest(mutant: dict) -> list[str]:
    """Return the tests that enter its function, those first whose file shares a word with the fault's."""
    words = set(Path(mutant["file"]).with_suffix("").as_posix().replace("/", "_").split("_"))
    return sorted(
        mutant["entered_by"], key=lambda test: -len(words & set(Path(test.split("::")[0]).stem.split("_")[1:]))
    )


def _first_failure(tree: Path, tests: list[str]) -> str | None:
    if not tests:
        return None
    ended = subprocess.run([*PYTEST, "-x", *tests], cwd=tree, capture_output=True, text=True, timeout=1200)
    return next((line.split()[1] for line in ended.stdout.splitlines() if line.startswith(("FAILED ", "ERROR "))), None)


if __name__ == "__main__":
    main()

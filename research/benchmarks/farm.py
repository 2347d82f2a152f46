# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch on two nodes of Ray that are killed while they work, against the same captures one after the other.

    python -m research.benchmarks.farm FOLDER [--captures 200] [--seed 0] [--json research/records/farm.json]

Real stages over twelve frames with small maps; a few different captures under many names, so that each has a twin among
those that ran one after the other. The nodes are namespaces with a hostname, a network and process numbers of their own
(research/benchmarks/farm_nodes.py), each with one of two processors. Processes that work on a task are killed at
random, a node is pulled from the network and killed, and comes back. Then: all are finished, every file is the twin's,
no stage was finished twice, and each that was begun and not finished is one that was killed. Exit code 0 only where all
that held.

It can be ended by Ctrl-C, or killed, and begun again with the same words: it goes on. Linux, as root.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from core.batch.groups import GROUPS
from core.batch.record import read_batch
from core.batch.state import DONE, derive_state
from core.capture.files import write_json
from core.capture.messages import Problem

from . import farm_batch, farm_nodes, figures
from .costs.meter import busy_s
from .farm_nodes import ADDRESSES, HEAD, PORT, WORKING, Node

EVERY_TASKS = 8
"""Tasks that end for each process that is killed, in the mean."""
FACES_PER_NODE = 100
"""Faces for each node that is killed; one at least."""
AWAY_S = 45.0
"""How long a node stays away: longer than the term of a lease, so that the other one has to take over what it held."""
EMPTY = {
    "seed": 0,
    "captures": 0,
    "serial": {},
    "wall_s": 0.0,
    "processor_s": 0.0,
    "busy_s": 0.0,
    "kills": [],
    "sessions": 0,
    "running": False,
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--captures", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, help="where the figures go, such as research/records/farm.json")
    options = parser.parse_args()
    try:
        farm_nodes.refuse_elsewhere()
        return FarmTrial(options.folder.absolute(), options.captures, options.seed).run(options.json)
    except Problem as problem:
        print(problem.problem, problem.remedy, sep="\n", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("Ended; the same words go on from here.", file=sys.stderr)
        return 130


class FarmTrial:
    """FOLDER/trial.json says how far it is."""

    def __init__(self, folder: Path, captures: int, seed: int):
        self.folder, self.captures, self.path = folder, captures, folder / "trial.json"
        self.state = (
            json.loads(self.path.read_text(encoding="utf-8"))
            if self.path.is_file()
            else {**EMPTY, "seed": seed, "captures": captures}
        )
        if (self.state["captures"], self.state["seed"]) != (captures, seed):
            raise Problem(
                f"{folder} holds a trial of {self.state['captures']} captures with the seed {self.state['seed']}.",
                "Name another folder.",
            )
        if self.state["running"]:  # it was killed itself, and everything with it
            self.note(None, None, "the benchmark")

    def save(self) -> None:
        write_json(self.path, self.state)

    def note(self, host: str | None, pid: int | None, action: str) -> None:
        self.state["kills"].append({"at": time.time(), "host": host, "pid": pid, "what": action})

    def run(self, record: Path | None) -> int:
        farm_batch.lay_out(self.folder, self.captures)
        self._run_serial()
        one = self._serial_s()
        print(
            f"One after the other {one:.0f} s a capture; {self.captures} on two nodes take "
            f"{self.captures * one / 120:.0f} min at best.",
            flush=True,
        )
        if self._left():
            self._run_farm()
        found = self._judge()
        for name, value in found.items():
            print(f"{name}: {value}")
        if record is not None:
            figures.write_record(
                record, "farm", f"python -m research.benchmarks.farm FOLDER --captures {self.captures}", found
            )
        return (
            0
            if found["finished"] == self.captures and not (found["unequal"] or found["twice"] or found["unexplained"])
            else 1
        )

    def _run_serial(self) -> None:
        """Each kind once, one after the other on one processor, as each node has one."""
        for name in farm_batch.twin_names():
            if name in self.state["serial"]:
                continue
            shutil.rmtree(self.folder / "serial" / f"{name}.wildcap", ignore_errors=True)
            began, counted = time.monotonic(), farm_nodes.counted_s() or 0.0
            environment = {key: value for key, value in os.environ.items() if key not in farm_nodes.THREAD_VARIABLES}
            command = [
                *farm_nodes.on_core(farm_nodes.cores()[0]),
                *farm_batch.core(),
                "run",
                str(self.folder / "serial"),
                name,
            ]
            with subprocess.Popen(
                command,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                cwd=farm_batch.code(self.folder),
                env=environment,
                preexec_fn=farm_nodes.join_account,
            ) as process:
                while process.poll() is None:
                    farm_nodes.keep_pace()
                    time.sleep(0.1)
                if process.returncode:
                    raise Problem(
                        f"The capture {name} did not end well: {process.stdout.read().strip()}", "Look into its logs."
                    )
            self.state["serial"][name] = {
                "wall_s": time.monotonic() - began,
                "processor_s": (farm_nodes.counted_s() or 0.0) - counted,
            }
            self.save()
            print(f"{name}: {self.state['serial'][name]['wall_s']:.0f} s", flush=True)

    def _serial_s(self, key: str = "wall_s") -> float:
        """Of one capture, the mean."""
        return sum(each[key] for each in self.state["serial"].values()) / len(self.state["serial"])

    def _left(self) -> int:
        batch = read_batch(self.folder / "farm")
        return sum(derive_state(batch, face).state != DONE for face in batch.faces)

    def _run_farm(self) -> None:
        with farm_nodes.farm(self.folder / "nodes") as nodes:
            self.state["running"], self.state["sessions"] = True, self.state["sessions"] + 1
            self.save()
            try:
                self._follow(nodes)
            except KeyboardInterrupt:
                self.note(None, None, "Ctrl-C")
                raise
            finally:
                self.state["running"] = False
                self.save()

    def _follow(self, nodes: dict[str, Node]) -> None:
        """Runs the batch from the head node, and kills meanwhile."""
        chance = random.Random(f"{self.state['seed']}.{self.state['sessions']}")
        tasks, moments, back = 0, [], {}
        next_kill, done = chance.uniform(0.2, 1.0) * EVERY_TASKS, self.captures - self._left()
        turns = [
            self.captures * (turn + chance.uniform(0.2, 0.6)) / self._nodes_to_kill()
            for turn in range(self._nodes_to_kill())
        ]
        driver = [
            *nodes[HEAD].enter(farm_batch.code(self.folder)),
            *farm_batch.core(),
            "run",
            str(self.folder / "farm"),
            "--on",
            "ray",
            "--address",
            f"{ADDRESSES[HEAD]}:{PORT}",
            "--cores",
            "1",
        ]
        with subprocess.Popen(
            driver,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=nodes[HEAD].environment,
            start_new_session=True,
        ) as process:
            try:
                lines: queue.Queue = queue.Queue()
                threading.Thread(target=lambda: [lines.put(line) for line in process.stdout], daemon=True).start()
                last, counted, busy = time.monotonic(), farm_nodes.counted_s() or 0.0, busy_s() or 0.0
                while process.poll() is None or not lines.empty():
                    farm_nodes.keep_pace()
                    ended = self._show(lines)
                    done, tasks, now = done + ended[0], tasks + ended[1], time.monotonic()
                    if tasks > next_kill:  # not at once: most tasks have just begun where one has ended
                        next_kill += chance.uniform(0.5, 1.5) * EVERY_TASKS
                        moments.append(now + chance.uniform(0, self._serial_s() / len(GROUPS)))
                    for moment in [moment for moment in moments if now > moment]:
                        moments.remove(moment)
                        self._kill_process(nodes, chance)
                    killed = sum(each["what"] == "node" for each in self.state["kills"])
                    if killed < len(turns) and done >= turns[killed] and not back:
                        node = nodes[chance.choice(WORKING)]
                        node.kill()
                        self.note(node.host, None, "node")
                        back[node.name] = now + AWAY_S
                        self._say(f"-- killed the node {node.host}")
                    for name in [name for name, at in back.items() if now > at]:
                        del back[name]
                        nodes[name].come_back()
                        self._say(f"-- the node {nodes[name].host} is back")
                    self.state["wall_s"] += now - last
                    self.state["processor_s"] += (farm_nodes.counted_s() or 0.0) - counted
                    self.state["busy_s"] += (busy_s() or 0.0) - busy
                    last, counted, busy = now, farm_nodes.counted_s() or 0.0, busy_s() or 0.0
                    self.save()
                    time.sleep(0.5)
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGINT)
                    time.sleep(3)
                    os.killpg(process.pid, signal.SIGKILL)

    def _show(self, lines: queue.Queue) -> tuple[int, int]:
        """Prints what the batch says; returns how many faces and tasks have ended."""
        faces = tasks = 0
        while not lines.empty():
            line = lines.get()
            self._say(line.rstrip())
            faces, tasks = faces + (f" of {self.captures}" in line), tasks + (" done in " in line)
        return faces, tasks

    def _say(self, text: str) -> None:
        print(f"{self.state['wall_s']:6.0f} s  {text}", flush=True)

    def _nodes_to_kill(self) -> int:
        return max(1, self.captures // FACES_PER_NODE)

    def _kill_process(self, nodes: dict[str, Node], chance: random.Random) -> None:
        tasks = sorted(
            (node.host, *task) for node in nodes.values() if node.process is not None for task in node.tasks()
        )
        if tasks:
            host, here, pid, name = chance.choice(tasks)
            try:
                os.kill(here, signal.SIGKILL)
            except ProcessLookupError:
                return
            self.note(host, pid, name)
            self._say(f"-- killed the process of {name} on {host}")

    def _judge(self) -> dict:
        state, unequal = self.state, farm_batch.unequal(self.folder, self.captures)
        for name in unequal[:5]:
            print(f"not the twin's: {name}")
        kills = [each["what"] for each in state["kills"]]
        nodes = kills.count("node")
        ours = sum(what in ("the benchmark", "Ctrl-C") for what in kills)
        account = farm_batch.judge_account(farm_batch.read_account(self.folder), state["kills"])
        serial = self._serial_s() * self.captures
        others = (
            (state["busy_s"] - state["processor_s"]) / state["wall_s"]
            if state["processor_s"] and state["wall_s"]
            else None
        )
        return {
            "captures": self.captures,
            "kinds": farm_batch.KINDS,
            "finished": self.captures - self._left(),
            "files": farm_batch.count_files(self.folder),
            "unequal": len(unequal),
            **account,
            "processes_killed": len(kills) - nodes - ours,
            "nodes_killed": nodes,
            "sessions": state["sessions"],
            "wall_s": state["wall_s"],
            "serial_s": serial,
            "ideal_s": serial / len(WORKING),
            "over_ideal": state["wall_s"] / (serial / len(WORKING)),
            "processor_s": state["processor_s"],
            "serial_processor_s": self._serial_s("processor_s") * self.captures,
            "others_cores": others,
        }


if __name__ == "__main__":
    sys.exit(main())

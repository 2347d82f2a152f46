# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch on a Ray cluster: each face is a chain of tasks, on nodes with the cores, memory and GPU they declare.

A Problem stops its face alone. When a process or a node dies, Ray gives the task to another one, which continues from
the capture's record. Ray is imported only where a batch runs on it; otherwise standard library only.
"""

from __future__ import annotations

import contextlib
import time
from collections import deque
from collections.abc import Callable, Iterable

from .. import __version__
from ..capture import lease
from ..capture.hashes import hash_file
from ..capture.messages import Problem, from_line
from .groups import GROUPS, StageGroup, groups_until
from .local import CANCELLED, EVERY_S, Board, forget_stop, is_asked_to_stop, next_task
from .ray_connection import connect
from .record import NAME, Batch, BatchFace
from .state import DONE, STOPPED, WORKING
from .task import ROOT

CODE = "WILDCAP_CODE"
"""Environment variable of a node: the folder that holds core/ there, if it differs from ours."""
EXAMINE_S = 60.0
"""Longest time for a node to start its first process, which imports Ray, perhaps from a network drive."""
FACES_AHEAD = 2
"""Faces submitted per free slot: enough to keep all cores busy and still finish the first faces early."""
CANCEL_S = 1.6
"""Time for cancelled tasks to release their captures; the rest end with the connection."""


def run_on_ray(
    batch: Batch,
    faces: Iterable[BatchFace],
    retry: bool,
    tell: Callable[[str], None],
    until: str | None,
    address: str | None,
    cores: int,
) -> dict[str, str]:
    """Run the remaining tasks of faces on a cluster, each with `cores`, as `run_local` does on this machine.

    `address` is HOST:PORT of the head node or "auto"; None makes a cluster of this machine. Raises Problem if there is
    no Ray, no cluster, or no node that can work on the batch.
    """
    faces = list(faces)
    forget_stop(batch.root)
    with connect(address) as ray:
        _examine_nodes(ray, batch, cores)
        run = _Run(ray, batch, faces, retry, Board(batch, len(faces), tell), until, cores)
        try:
            while run.is_under_way() and not is_asked_to_stop(batch.root):
                run.advance()
        finally:
            run.end()
            forget_stop(batch.root)
    return run.board.ended


class _Run:
    """Faces on their way through the cluster: `advance` until nothing is under way, then `end`."""

    def __init__(
        self, ray, batch: Batch, faces: list[BatchFace], retry: bool, board: Board, until: str | None, cores: int
    ):
        self._ray, self._batch, self._retry, self._cores = ray, batch, retry, cores
        self.board = board
        self._groups = groups_until(until)
        self._left = deque(faces)
        self._tasks: dict = {}  # Ray's reference -> (face, group)
        self._call, self._post = _define_call(ray), _define_post(ray)
        self._places: dict[str, str] = {}  # face -> node that works on it
        self._request, self._heard = None, 0.0
        board.write(now=True)

    def is_under_way(self) -> bool:
        return bool(self._left or self._tasks)

    def advance(self) -> None:
        """Submit faces, collect results and progress; return within half a second."""
        slots = max(1, int(self._ray.cluster_resources().get("CPU", 0) / self._cores))
        under_way = {face.name for face, _ in self._tasks.values()}
        while self._left and len(under_way) < FACES_AHEAD * slots:
            face = self._left.popleft()
            if self._begin(face):
                under_way.add(face.name)
        for ref in self._ray.wait(list(self._tasks), timeout=0.3)[0] if self._tasks else ():
            if ref in self._tasks:
                self._take(ref, *self._tasks.pop(ref))
        self._hear()

    def _begin(self, face: BatchFace, again: bool = False) -> bool:
        """Submit the remaining tasks of a face and return whether there were any; `again`: it was ours before."""
        state = next_task(self._batch, face, self._groups, self._retry, self.board)
        if state is None:
            return False
        has_gpu = self._ray.cluster_resources().get("GPU", 0) > 0 and face.chosen().device != "cpu"
        holder = lease.holder(face.capture.lock) if state.state == WORKING and not again else None
        stranger = str((holder or {}).get("token", ""))
        before = None
        for group in self._groups[self._groups.index(state.group) :]:
            task = self._call.options(
                name=f"{face.name}.{group.name}",
                num_cpus=self._cores,
                memory=_bytes(group),
                num_gpus=int(has_gpu and group.on_device),
                max_retries=-1,
                retry_exceptions=False,
            )
            words = (str(self._batch.root), face.name, group.name, self._cores, stranger)
            before = task.remote(before, str(ROOT), "do_task", self._post, *words)
            self._tasks[before] = face, group
        return True

    def _take(self, ref, face: BatchFace, group: StageGroup) -> None:
        """Collect the result of a task; a face that ends takes its later tasks with it."""
        try:
            outcome = self._ray.get(ref)
        except self._ray.exceptions.RayTaskError:
            raise  # an error of our own code
        except self._ray.exceptions.RayError as error:
            words = f"Ray gave the task up ({type(error).__name__}). Run the batch again: finished stages are kept."
            outcome = {"state": STOPPED, "words": words}
        self.board.worked.add(face.name)
        self._places.pop(face.name, None)
        label, words = group.label.lower(), outcome["words"]
        if outcome["state"] == DONE:
            self.board.say(face, f"{label} done in {outcome['seconds']:.0f} s on {outcome['host']}")
            if group is self._groups[-1]:
                self.board.end(face, DONE, "done")
            return
        self._tasks = {other: task for other, task in self._tasks.items() if task[0].name != face.name}
        self.board.end(face, outcome["state"], f"{label} stopped: {words}" if outcome["state"] == STOPPED else words)

    def _hear(self) -> None:
        """Ask the post for places and progress once in a while, without waiting for the answer."""
        if self._request is None and time.monotonic() - self._heard > EVERY_S:
            self._request, self._heard = self._post.take.remote(), time.monotonic()
        if self._request is None or not self._ray.wait([self._request], timeout=0)[0]:
            return
        request, self._request = self._request, None
        working = {face.name: face for face, _ in self._tasks.values()}
        with contextlib.suppress(self._ray.exceptions.RayError):
            places, lines = self._ray.get(request)
            self._places |= {name: node for name, node in places.items() if name in working}
            for name in lines.keys() & working.keys():
                self.board.hear(working[name], from_line(lines[name]))
            self._leave_dead_nodes(working)

    def _leave_dead_nodes(self, working: dict[str, BatchFace]) -> None:
        """Submit again the faces of nodes that the cluster has given up.

        Ray does so by itself where a connection breaks. Where a node only falls silent, as at a power cut, it waits for
        five minutes, and with a shorter RAY_grpc_client_keepalive_time_ms the other side takes us for an attack.
        """
        alive = {node["NodeID"] for node in self._ray.nodes() if node["Alive"]}
        for name in [name for name, node in self._places.items() if node not in alive]:
            del self._places[name]
            for ref in [ref for ref, task in self._tasks.items() if task[0].name == name]:
                del self._tasks[ref]
                self._ray.cancel(ref)
            if name in working:
                self._begin(working[name], again=True)

    def end(self) -> None:
        """Cancel what is under way, and wait a moment for it."""
        refs, faces = list(self._tasks), {face.name: face for face, _ in self._tasks.values()}
        for ref in refs:
            self._ray.cancel(ref)
        if refs:
            self._ray.wait(refs, num_returns=len(refs), timeout=CANCEL_S)
        for face in faces.values():
            self.board.end(face, CANCELLED, "cancelled; finished stages are kept")
        self.board.write(now=True)


def _bytes(group: StageGroup) -> int:
    return int(group.memory_gb * 2**30)


def _define_call(ray):
    """Return the remote function that runs a task. Ray ships it as source; it finds WildCap on its node by a path.

    `before` is the outcome of the face's previous task, which is passed on unless that succeeded.
    """
    variable, package = CODE, f"{__package__.rpartition('.')[0].rpartition('.')[2]}.batch.ray_task"

    @ray.remote
    def call(before, code, function, post, *words):
        import importlib
        import os
        import socket
        import sys

        import ray

        if before is not None and before["state"] != "done":
            return before
        code = os.environ.get(variable, code)
        # this Python may find another core elsewhere
        if not os.path.isfile(os.path.join(code, *package.split(".")) + ".py"):
            problem = f"The node {socket.gethostname()} has no WildCap at {code}. Set {variable} there."
            return {"state": "stopped", "words": problem}
        sys.path[:] = [code, *(place for place in sys.path if place != code)]
        module = importlib.import_module(package)
        if post is None:
            return {"state": "done", "words": getattr(module, function)(*words)}
        post.be_at.remote(words[1], ray.get_runtime_context().get_node_id())
        return getattr(module, function)(*words, lambda line: post.put.remote(words[1], line))

    return call


def _define_post(ray):
    """Return an actor on this node that collects each face's node and last line of progress."""

    @ray.remote(num_cpus=0, max_restarts=-1)
    class Post:
        def __init__(self):
            self.places, self.lines = {}, {}

        def be_at(self, name, node):
            self.places[name] = node

        def put(self, name, line):
            self.lines[name] = line

        def take(self):
            taken, (self.places, self.lines) = (self.places, self.lines), ({}, {})
            return taken

    return Post.options(scheduling_strategy=_pin(ray, ray.get_runtime_context().get_node_id())).remote()


def _pin(ray, node: str):
    """Return Ray's strategy for this node and no other."""
    return ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy(node, soft=False)


def _examine_nodes(ray, batch: Batch, cores: int) -> None:
    """Raise Problem if no node has what a task needs, or if one lacks the code or the batch."""
    need = max(GROUPS, key=lambda group: group.memory_gb)
    fit = [
        node["NodeID"]
        for node in ray.nodes()
        if node["Alive"]
        and node["Resources"].get("CPU", 0) >= cores
        and node["Resources"].get("memory", 0) >= _bytes(need)
    ]
    if not fit:
        raise Problem(
            f"No node of the cluster has {cores} core{'' if cores == 1 else 's'} and {need.memory_gb:.0f} GB, as the "
            f"task {need.name} needs.",
            "Start one with `ray start` and its --num-cpus and --memory, or give each task fewer cores with --cores.",
        )
    call, words = _define_call(ray), ("examine", None, str(batch.root), __version__, hash_file(batch.root / NAME))
    pending = [
        call.options(num_cpus=0, scheduling_strategy=_pin(ray, node)).remote(None, str(ROOT), *words) for node in fit
    ]
    answered, _ = ray.wait(pending, num_returns=len(pending), timeout=EXAMINE_S)
    for ref in answered:
        with contextlib.suppress(ray.exceptions.RayError):  # a node that has just gone
            outcome = ray.get(ref)
            if outcome["words"]:
                raise Problem(
                    outcome["words"],
                    "Give the node the same WildCap, its packages, and the batch's folder under the same path (see "
                    "docs/farm.md), or stop Ray there.",
                )

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch on a cluster of Ray's: each face a chain of tasks, on whichever nodes have the cores, the memory and the GPU
that a task declares.

A Problem is an outcome and stops its face alone. A process or a node that dies is Ray's to notice: it gives the task to
another one, which goes on from the capture's record. Ray is imported where a batch runs on it; otherwise standard
library only.
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
from .groups import GROUPS, StageGroup
from .local import CANCELLED, EVERY_S, Board, Tally, forget_stop, is_asked_to_stop
from .ray_connection import connect
from .record import NAME, Batch, BatchFace
from .state import DONE, STOPPED, TO_DO, WAITING, WORKING, FaceState, derive_state
from .task import ROOT

CODE = "WILDCAP_CODE"
"""Environment variable of a node: the folder that holds core/ there, where that is another one than where the batch is
run from."""
EXAMINE_S = 60.0
"""How long a node may take to start its first process: it imports Ray, maybe from a network's disk."""
FACES_AHEAD = 2
"""Faces that are under way for each that could be worked on at once: enough that no core waits, and the first faces are
done long before the last."""
OUT_S = 1.6
"""How long tasks that are cancelled may take to give their captures back; those that are still there end with our
connection."""


def run_on_ray(
    batch: Batch,
    faces: Iterable[BatchFace],
    retry: bool,
    tell: Callable[[str], None],
    until: str | None,
    address: str | None,
    cores: int,
) -> Tally:
    """Runs what is to be done of these faces on a cluster. The caller holds the batch's lease. Ends early by
    KeyboardInterrupt or the file `stop`; what was finished is kept.

    Parameters
    ----------
    batch, faces, retry, tell, until : as `run_local` takes them
    address : HOST:PORT of the cluster's head node, or auto; None: a cluster of this machine alone
    cores : that each task takes

    Returns
    -------
    How each face ended.

    Raises
    ------
    Problem
        Where there is no Ray, no cluster, or no node that could work on the batch.
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
    return run.board.tally


class _Run:
    """Faces on their way through the cluster. `advance` until nothing is under way, then `end`."""

    def __init__(
        self, ray, batch: Batch, faces: list[BatchFace], retry: bool, board: Board, until: str | None, cores: int
    ):
        self._ray, self._batch, self._retry, self._cores = ray, batch, retry, cores
        self.board = board
        names = [group.name for group in GROUPS]
        self._groups = GROUPS[: names.index(until) + 1 if until else None]
        self._left = deque(faces)
        self._tasks: dict = {}  # Ray's reference -> (face, group, whether it is the face's last)
        self._call, self._post = _define_call(ray), _define_post(ray)
        self._places: dict[str, str] = {}  # face -> the node that said that it works on it
        self._asked, self._heard = None, 0.0
        board.write(now=True)

    def is_under_way(self) -> bool:
        return bool(self._left or self._tasks)

    def advance(self) -> None:
        """Begins faces, takes outcomes and progress; lasts half a second at most where nothing happens."""
        slots = max(1, int(self._ray.cluster_resources().get("CPU", 0) / self._cores))
        under_way = {face.name for face, _, _ in self._tasks.values()}
        while self._left and len(under_way) < FACES_AHEAD * slots:
            face = self._left.popleft()
            if self._begin(face):
                under_way.add(face.name)
        for ref in self._ray.wait(list(self._tasks), timeout=0.3)[0] if self._tasks else ():
            if ref in self._tasks:
                self._take(ref, *self._tasks.pop(ref))
        self._hear()

    def _begin(self, face: BatchFace, again: bool = False) -> bool:
        """Submits what is left of a face, `again` where we had it before; False where that is nothing."""
        state = derive_state(self._batch, face)
        if state.state == STOPPED and self._retry and state.group is not None:
            state = FaceState(TO_DO, state.group)
        if state.state == DONE or state.group not in self._groups and state.state != STOPPED:
            self.board.end(face, DONE, "done")
            return False
        if state.state not in (TO_DO, WORKING):  # who works there may be a machine that has gone: the task finds out
            self.board.end(face, WAITING if state.state == WAITING else STOPPED, state.words())
            return False
        has_gpu = self._ray.cluster_resources().get("GPU", 0) > 0 and face.chosen().device != "cpu"
        before, holder = None, lease.holder(face.capture.lock) if state.state == WORKING and not again else None
        stranger = str((holder or {}).get("token", ""))
        for group in self._groups[self._groups.index(state.group) :]:
            task = self._call.options(
                name=f"{face.name}.{group.name}",
                num_cpus=self._cores,
                memory=_bytes(group),
                num_gpus=int(has_gpu and group.on_device),
                max_retries=-1,
                retry_exceptions=False,
            )
            before = task.remote(
                before,
                str(ROOT),
                "do_task",
                self._post,
                str(self._batch.root),
                face.name,
                group.name,
                self._cores,
                stranger,
            )
            self._tasks[before] = face, group, group is self._groups[-1]
        return True

    def _take(self, ref, face: BatchFace, group: StageGroup, is_last: bool) -> None:
        try:
            outcome = self._ray.get(ref)
        except self._ray.exceptions.RayTaskError:
            raise  # an error of ours is told as one
        except self._ray.exceptions.RayError as error:
            outcome = {
                "state": STOPPED,
                "words": f"Ray has given the task up ({type(error).__name__}). Run the batch again: finished "
                "stages are kept.",
            }
        self.board.tally.worked.add(face.name)
        self._places.pop(face.name, None)
        if outcome["state"] == DONE:
            self.board.say(face, f"{group.label.lower()} done in {outcome['seconds']:.0f} s on {outcome['host']}")
            if is_last:
                self.board.end(face, DONE, "done")
            return
        # they pass the outcome on
        self._tasks = {other: task for other, task in self._tasks.items() if task[0].name != face.name}
        self.board.end(
            face,
            outcome["state"],
            f"{group.label.lower()} stopped: {outcome['words']}" if outcome["state"] == STOPPED else outcome["words"],
        )

    def _hear(self) -> None:
        """What tasks say of where they are and how far, asked for once in a while and not waited for; nothing is lost
        where that cannot be had."""
        if self._asked is None and time.monotonic() - self._heard > EVERY_S:
            self._asked, self._heard = self._post.take.remote(), time.monotonic()
        if self._asked is None or not self._ray.wait([self._asked], timeout=0)[0]:
            return
        request, self._asked = self._asked, None
        working = {face.name: face for face, _, _ in self._tasks.values()}
        with contextlib.suppress(self._ray.exceptions.RayError):
            places, lines = self._ray.get(request)
            self._places |= {name: node for name, node in places.items() if name in working}
            for name in lines.keys() & working.keys():
                self.board.hear(working[name], from_line(lines[name]))
            self._leave_dead_nodes(working)

    def _leave_dead_nodes(self, working: dict[str, BatchFace]) -> None:
        """Has faces done elsewhere whose node has been given up. Ray does so by itself where a connection breaks; where
        one only falls silent, as at a power cut, it waits for five minutes, and its setting for that
        (RAY_grpc_client_keepalive_time_ms) has the other side take us for an attack."""
        alive = {node["NodeID"] for node in self._ray.nodes() if node["Alive"]}
        for name in [name for name, node in self._places.items() if node not in alive]:
            del self._places[name]
            for ref in [ref for ref, task in self._tasks.items() if task[0].name == name]:
                del self._tasks[ref]
                self._ray.cancel(ref)
            if name in working:
                self._begin(working[name], again=True)

    def end(self) -> None:
        """Cancels what is under way, wherever it is, and waits a moment for it."""
        refs, faces = list(self._tasks), {face.name: face for face, _, _ in self._tasks.values()}
        for ref in refs:
            self._ray.cancel(ref)
        if refs:
            self._ray.wait(refs, num_returns=len(refs), timeout=OUT_S)
        for face in faces.values():
            self.board.end(face, CANCELLED, "cancelled; what was finished is kept")
        self.board.write(now=True)


def _bytes(group: StageGroup) -> int:
    return int(group.memory_gb * 2**30)


def _define_call(ray):
    """The remote function in which every task runs. It goes to the nodes by its source and finds WildCap there by a
    path; `before` is the outcome of the face's task before, which is passed on where that did not end well."""
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
        # another one may lie where this Python looks as well
        if not os.path.isfile(os.path.join(code, *package.split(".")) + ".py"):
            return {
                "state": "stopped",
                "words": f"The node {socket.gethostname()} has no WildCap at {code}. Set {variable} there.",
            }
        sys.path[:] = [code, *(place for place in sys.path if place != code)]
        module = importlib.import_module(package)
        if post is None:
            return {"state": "done", "words": getattr(module, function)(*words)}
        post.be_at.remote(words[1], ray.get_runtime_context().get_node_id())
        return getattr(module, function)(*words, lambda line: post.put.remote(words[1], line))

    return call


def _define_post(ray):
    """An actor beside us, for what tasks say: of each face the node that works on it, and the last line of progress."""

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

    strategy = ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy
    here = strategy(ray.get_runtime_context().get_node_id(), soft=False)
    return Post.options(scheduling_strategy=here).remote()


def _examine_nodes(ray, batch: Batch, cores: int) -> None:
    """Raises Problem where no node has what a task needs, and for the first one that does not have the code or see the
    batch: it would stop face after face."""
    need = max(GROUPS, key=lambda group: group.memory_gb)
    fit = [
        node
        for node in ray.nodes()
        if node["Alive"]
        and node["Resources"].get("CPU", 0) >= cores
        and node["Resources"].get("memory", 0) >= _bytes(need)
    ]
    if not fit:
        raise Problem(
            f"No node of the cluster has {cores} core{'' if cores == 1 else 's'} and {need.memory_gb:.0f} "
            f"GB, as the task {need.name} needs.",
            "Start one with `ray start` and its --num-cpus and --memory, or have each task take fewer cores "
            "with --cores.",
        )
    call, words = _define_call(ray), ("examine", None, str(batch.root), __version__, hash_file(batch.root / NAME))
    pending = [
        call.options(
            num_cpus=0,
            scheduling_strategy=ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy(
                node["NodeID"], soft=False
            ),
        ).remote(None, str(ROOT), *words)
        for node in fit
    ]
    answered, _ = ray.wait(pending, num_returns=len(pending), timeout=EXAMINE_S)
    for ref in answered:
        with contextlib.suppress(ray.exceptions.RayError):  # a node that has just gone harms nobody
            outcome = ray.get(ref)
            if outcome["words"]:
                raise Problem(
                    outcome["words"],
                    "Give the node the same WildCap, its packages, and the batch's folder under the same "
                    "path, as the page on farms"
                    " (docs/farm.md) says; or stop Ray there.",
                )

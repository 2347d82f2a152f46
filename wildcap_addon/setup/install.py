# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that make the solver's environment and take it away; each says first what that means in gigabytes."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.messages import Problem
from ...core.worker import environment, index, installation
from .. import jobs, preferences, problems
from ..base_operator import BaseOperator
from . import asking
from .checking import REQUIREMENTS, accept

COMPUTES = {"cpu": "the CPU", "cuda": "NVIDIA GPUs (CUDA)", "apple": "Apple GPUs (Metal)"}
WIDTH = 460


class Dialog(BaseOperator):
    """Mixin: an operator that asks for a yes to `lines`. `tell()` gives them, or None while they are being found out."""

    lines: tuple[str, ...] = ()

    def invoke(self, context, event):
        try:
            self.lines = self.tell()
        except Problem as problem:
            return self._refuse("", problem)
        if self.lines is None:
            return {'CANCELLED'}
        title = f"{iface_(self.bl_label, 'Operator')}?"
        return context.window_manager.invoke_props_dialog(self, width=WIDTH, title=title, confirm_text=self.bl_label.partition(" ")[0])

    def draw(self, context):
        for line in self.lines:
            problems.draw_text(self.layout, line, WIDTH)


class WILDCAP_OT_install_solver(Dialog, bpy.types.Operator):
    """Install the solver's packages into a folder of their own: first you are told what, how much, from where and to where. Blender's Python
    stays as it is"""

    bl_idname = "wildcap.install_solver"
    bl_label = "Install Solver"

    @classmethod
    def poll(cls, context):
        return cls.allowed(jobs.of("") is None, "The solver is being installed already: wait for it, or click Cancel")

    @staticmethod
    def tell() -> tuple[str, ...] | None:
        require_online()
        compute, source, folder = *chosen(), preferences.environment_folder()
        plan = asking.answer(("plan", compute, source))
        if plan is None:
            asking.ask(("plan", compute, source), lambda task: look_up(task, compute, source), "install_solver")
            return None
        return told(plan, compute, folder, index.check_space(plan, folder))

    def work(self, context):
        require_online()
        compute, source, folder = *chosen(), preferences.environment_folder()
        plan = asking.answer(("plan", compute, source))
        if plan is not None:
            index.check_space(plan, folder)
        task = installation.installation(folder, REQUIREMENTS, folder.with_name(f"{folder.name}.log"), compute=compute, source=source,
                                         packages=len(plan.packages) if plan is not None else 0)
        asking.forget(("size", str(folder)))
        jobs.begin("", "install", task, lambda: accept(environment.python_of(folder)))


class WILDCAP_OT_remove_solver(Dialog, bpy.types.Operator):
    """Delete the folder that Install Solver made, also one that it did not finish; you are told first how much that frees. Captures stay"""

    bl_idname = "wildcap.remove_solver"
    bl_label = "Remove Solver"

    @classmethod
    def poll(cls, context):
        return (cls.allowed(jobs.of("") is None, "The solver is being installed: wait for it, or click Cancel")
                and cls.allowed(preferences.environment_folder().is_dir(), "Install Solver has made no folder on this machine"))

    @staticmethod
    def tell() -> tuple[str, ...] | None:
        folder = preferences.environment_folder()
        size = asking.answer(("size", str(folder)))
        if size is None:
            asking.ask(("size", str(folder)), lambda task: measure(task, folder), "remove_solver")
            return None
        return (iface_("Deletes {} and frees {}.").format(folder, index.gigabytes(size)),
                "Captures, masks and maps stay; what pip keeps in its own cache stays, too.")

    def work(self, context):
        folder = preferences.environment_folder()
        environment.check_removable(folder)
        asking.forget(("size", str(folder)))
        if preferences.get().python == str(environment.python_of(folder)):
            preferences.set_python(None)
        jobs.begin("", "ask", environment.removal(folder))


def told(plan: index.Plan, compute: str, folder: Path, free: int) -> tuple[str, ...]:
    """What an installation means, before the artist says yes; `free` bytes are on the folder's disk."""
    return (iface_("PyTorch {} for {} and {} more packages.").format(plan.packages.get("torch", ""), iface_(COMPUTES[compute]), len(plan.packages) - 1),
            iface_("{} to download from {}.").format(index.gigabytes(plan.download), ", ".join(plan.hosts)),
            iface_("{} on disk in {}, where {} are free.").format(index.gigabytes(plan.disk), folder, index.gigabytes(free)),
            "You can go on working meanwhile, cancel, and continue later.")


def chosen() -> tuple[str, str]:
    """(compute, source) of the preferences, with what Automatic means here. Raises Problem for what cannot be here."""
    return installation.compute_of(preferences.get().compute), preferences.get().packages


def require_online() -> None:
    """Raises Problem while Blender is told to stay off the network."""
    if not bpy.app.online_access:
        where = "" if bpy.app.online_access_override else " (Preferences, System, Network)"
        raise Problem("Blender is set to work offline.", f"Allow online access{where}, or use a Python that has the packages already.")


def look_up(task, compute: str, source: str) -> index.Plan:
    """The plan of an installation, asked of the package index."""
    task.say(0, 4, "looking for a Python to begin with")
    return index.plan(installation.base_python(), installation.pip_steps(REQUIREMENTS, compute, source), task.run, task.say)


def measure(task, folder) -> int:
    """Bytes that removing the folder frees."""
    task.say(0, 1, "adding up what the solver takes")
    return index.folder_size(folder)


CLASSES = (WILDCAP_OT_install_solver, WILDCAP_OT_remove_solver)

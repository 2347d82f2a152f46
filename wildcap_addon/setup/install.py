# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that install and remove the solver's environment; each first shows its size."""

import os
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.worker import environment, index, installation, locks, pip_steps
from .. import asking, jobs, preferences
from ..base_operator import Dialog
from .checking import REQUIREMENTS, accept

COMPUTES = {"cpu": "the CPU", "cuda": "NVIDIA GPUs (CUDA)", "apple": "Apple GPUs (Metal)"}


class WILDCAP_OT_install_solver(Dialog, bpy.types.Operator):
    """Install the solver's packages into a folder of their own; Blender's Python is not changed.

    A dialog first shows what is downloaded, how much, from where and to where.
    """

    bl_idname = "wildcap.install_solver"
    bl_label = "Install Solver"

    @classmethod
    def poll(cls, context):
        return cls.allowed(jobs.of("") is None, "The solver is being installed already: wait for it, or click Cancel")

    @staticmethod
    def tell() -> tuple[str, ...] | None:
        (compute, source, wheels), folder = chosen_packages(), preferences.environment_folder()
        plan = asking.find_answer(
            ("plan", compute, source, wheels),
            "looking for a Python to begin with",
            lambda task: look_up_plan(task, compute, source, wheels, folder),
            "install_solver",
        )
        return describe_plan(plan, compute, folder, index.check_space(plan, folder)) if plan else None

    def work(self, context):
        packages, folder = chosen_packages(), preferences.environment_folder()
        plan = asking.answer(("plan", *packages))
        if plan is not None:
            index.check_space(plan, folder)
        task = installation.installation(
            folder,
            REQUIREMENTS,
            folder.with_name(f"{folder.name}.wildcap-install.log"),
            None,
            installation.PackageSource(*packages),
            len(plan.packages) if plan is not None else 0,
        )
        asking.forget(("size", str(folder)))
        jobs.start_worker("", "install", task, lambda: accept(environment.python_of(folder)))


class WILDCAP_OT_remove_solver(Dialog, bpy.types.Operator):
    """Delete the folder that Install Solver made, even if incomplete; captures stay.

    A dialog first shows how much that frees.
    """

    bl_idname = "wildcap.remove_solver"
    bl_label = "Remove Solver"

    @classmethod
    def poll(cls, context):
        return cls.allowed(
            jobs.of("") is None, "The solver is being installed: wait for it, or click Cancel"
        ) and cls.allowed(
            preferences.environment_folder().is_dir(), "Install Solver has made no folder on this machine"
        )

    @staticmethod
    def tell() -> tuple[str, ...] | None:
        folder = preferences.environment_folder()
        size = asking.find_answer(
            ("size", str(folder)),
            "adding up what the solver takes",
            lambda task: index.folder_size(folder),
            "remove_solver",
        )
        if size is None:
            return None
        return (
            iface_("Deletes {} and frees {}.").format(folder, index.gigabytes(size)),
            "Captures, masks and maps stay; what pip keeps in its own cache stays, too.",
        )

    def work(self, context):
        folder = preferences.environment_folder()
        environment.check_removable(folder)
        asking.forget(("size", str(folder)))
        if preferences.get().python == str(environment.python_of(folder)):
            preferences.set_python(None)
        jobs.start_worker("", "ask", environment.removal(folder))


def describe_plan(plan: index.InstallationPlan, compute: str, folder: Path, free: int) -> tuple[str, ...]:
    """Return the dialog's lines; `free` is in bytes."""
    torch, others = plan.packages.get("torch", ""), len(plan.packages) - 1
    download, disk, free = map(index.gigabytes, (plan.download, plan.disk, free))
    return (
        iface_("PyTorch {} for {} and {} more packages.").format(torch, iface_(COMPUTES[compute]), others),
        iface_("{} to download from {}.").format(download, ", ".join(plan.hosts)),
        iface_("{} on disk in {}, where {} are free.").format(disk, folder, free),
        "You can go on working meanwhile, cancel, and continue later.",
    )


def chosen_packages() -> tuple[str, str, Path | None]:
    """Return (compute, source, wheels) of the preferences, with Automatic resolved.

    Raises Problem for choices that are impossible on this machine, or need a network while Blender is offline.
    """
    source = preferences.get().packages
    if source != 'folder':
        preferences.require_online(
            "choose A Folder of Wheels under Package Source, or use a Python that has the packages already"
        )
    return pip_steps.compute_of(preferences.get().compute), source, preferences.wheels_folder()


def look_up_plan(task, compute: str, source: str, wheels: Path | None, folder: Path) -> index.InstallationPlan:
    """Ask the package index about an installation. `task` runs pip and shows the progress.

    Raises Problem if there is no Python to begin with or no solver for this machine, if the folder's path is too long,
    or if the index cannot be reached or lacks a package.
    """
    base = installation.base_python()
    locks.check_path(pip_steps.lock_of(base, REQUIREMENTS), folder, limited=os.name == "nt")
    return index.plan_installation(REQUIREMENTS, base, compute, source, task.run, task.say, wheels)


CLASSES = (WILDCAP_OT_install_solver, WILDCAP_OT_remove_solver)

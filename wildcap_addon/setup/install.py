# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that make the solver's environment and take it away; each says first what that means in gigabytes."""

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
    """Install the solver's packages into a folder of their own: first you are told what, how much, from where and to
    where. Blender's Python stays as it is"""

    bl_idname = "wildcap.install_solver"
    bl_label = "Install Solver"

    @classmethod
    def poll(cls, context):
        return cls.allowed(jobs.of("") is None, "The solver is being installed already: wait for it, or click Cancel")

    @staticmethod
    def tell() -> tuple[str, ...] | None:
        compute, source, wheels, folder = *chosen_packages(), preferences.environment_folder()
        plan = asking.answer(("plan", compute, source, wheels))
        if plan is None:
            asking.find_answer(
                ("plan", compute, source, wheels),
                lambda task: look_up_plan(task, compute, source, wheels, folder),
                "install_solver",
            )
            return None
        return describe_plan(plan, compute, folder, index.check_space(plan, folder))

    def work(self, context):
        compute, source, wheels, folder = *chosen_packages(), preferences.environment_folder()
        plan = asking.answer(("plan", compute, source, wheels))
        if plan is not None:
            index.check_space(plan, folder)
        log = folder.with_name(f"{folder.name}.wildcap-install.log")
        task = installation.installation(
            folder,
            REQUIREMENTS,
            log,
            None,
            installation.PackageSource(compute, source, wheels),
            len(plan.packages) if plan is not None else 0,
        )
        asking.forget(("size", str(folder)))
        jobs.start_worker("", "install", task, lambda: accept(environment.python_of(folder)))


class WILDCAP_OT_remove_solver(Dialog, bpy.types.Operator):
    """Delete the folder that Install Solver made, including one that it did not finish; you are told first how much
    that frees. Captures stay"""

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
        size = asking.answer(("size", str(folder)))
        if size is None:
            asking.find_answer(("size", str(folder)), lambda task: measure(task, folder), "remove_solver")
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
    """What an installation means, before the artist says yes.

    Parameters
    ----------
    plan : of the installation
    compute : a key of COMPUTES
    folder : installed to
    free : bytes on that folder's disk

    Returns
    -------
    The dialog's lines.
    """
    torch, others = plan.packages.get("torch", ""), len(plan.packages) - 1
    return (
        iface_("PyTorch {} for {} and {} more packages.").format(torch, iface_(COMPUTES[compute]), others),
        iface_("{} to download from {}.").format(index.gigabytes(plan.download), ", ".join(plan.hosts)),
        iface_("{} on disk in {}, where {} are free.").format(
            index.gigabytes(plan.disk), folder, index.gigabytes(free)
        ),
        "You can go on working meanwhile, cancel, and continue later.",
    )


def chosen_packages() -> tuple[str, str, Path | None]:
    """(compute, source, wheels) of the preferences, with what Automatic means here. Raises Problem for what cannot be
    here, and while Blender is to stay off a network that is needed."""
    source = preferences.get().packages
    if source != 'folder':
        preferences.require_online(
            "choose A Folder of Wheels under Packages From, or use a Python that has the packages already"
        )
    return pip_steps.compute_of(preferences.get().compute), source, preferences.wheels_folder()


def look_up_plan(task, compute: str, source: str, wheels: Path | None, folder: Path) -> index.InstallationPlan:
    """Asks the package index what an installation would bring.

    Parameters
    ----------
    task : says how far it is, and runs pip
    compute : a key of COMPUTES
    source : as the preferences have it under Packages From
    wheels : their folder; None where they come from the index
    folder : installed to

    Raises
    ------
    Problem
        Where there is no Python to begin with or no solver for this machine, the folder's path is too long, or the
        index cannot be reached or lacks a package.
    """
    task.say(0, 4, "looking for a Python to begin with")
    base = installation.base_python()
    locks.check_path(pip_steps.lock_of(base, REQUIREMENTS), folder, limited=os.name == "nt")
    return index.plan_installation(REQUIREMENTS, base, compute, source, task.run, task.say, wheels)


def measure(task, folder) -> int:
    """Bytes that removing the folder frees."""
    task.say(0, 1, "adding up what the solver takes")
    return index.folder_size(folder)


CLASSES = (WILDCAP_OT_install_solver, WILDCAP_OT_remove_solver)

# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences of the extension: the solver's Python, and the folder of captures."""

import os
import sys
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.capture import links, switchlight_api
from ..core.capture.messages import Problem
from ..core.worker import environment
from . import extension

COMPUTES = [
    ('auto', "Automatic", "For the GPU where there is an NVIDIA one or an Apple one, else for the CPU"),
    *(
        [('apple', "Apple", "For Apple GPUs, by Metal; the CPU can be chosen as well")]
        if sys.platform == "darwin"
        else [('cuda', "CUDA", "For NVIDIA GPUs; several times larger")]
    ),
    ('cpu', "CPU", "For the processor alone: the smallest"),
]
SOURCES = [
    (
        'pytorch',
        "PyTorch and PyPI",
        "PyTorch from its own package index where PyPI lacks the build for your device, all others from PyPI",
    ),
    (
        'folder',
        "A Folder of Wheels",
        "All packages from a folder, as `python -m core wheels` makes one: no network needed",
    ),
    (
        'pip',
        "As pip Is Set Up",
        "All packages from the index of this machine's pip configuration (pip.conf, PIP_INDEX_URL), such as a "
        "studio's own; that also decides what its PyTorch computes on",
    ),
]
DEVICES = {"cpu": "CPU", "cuda": "CUDA", "mps": "Metal", "": ""}
_aside: set[str] = set()  # Pythons that did not answer in this session


class WILDCAP_AP_preferences(bpy.types.AddonPreferences):
    bl_idname = extension.NAME

    python: bpy.props.StringProperty(
        name="Solver Python",
        subtype='FILE_PATH',
        description="Python that runs the solver, with the packages of requirements/worker.txt installed",
    )
    environment: bpy.props.StringProperty(
        name="Solver Folder",
        subtype='DIR_PATH',
        description="Folder of Install Solver's packages; empty: .wildcap/solver in your home folder",
    )
    compute: bpy.props.EnumProperty(
        name="Hardware",
        items=COMPUTES,
        default='auto',
        description="Hardware that Install Solver downloads PyTorch for",
    )
    packages: bpy.props.EnumProperty(
        name="Package Source", items=SOURCES, default='pytorch', description="Source of Install Solver's downloads"
    )
    wheels: bpy.props.StringProperty(
        name="Wheels",
        subtype='DIR_PATH',
        description="The folder of wheels that Install Solver takes all packages from",
    )
    device: bpy.props.StringProperty(name="Device", description="Device that the solver's Python computes on")
    device_reason: bpy.props.StringProperty(
        name="Why This Device", description="Result of the test of the solver's devices"
    )
    tested: bpy.props.StringProperty(name="Self-Test", description="Result of the last self-test")
    captures: bpy.props.StringProperty(
        name="Captures Folder",
        subtype='DIR_PATH',
        description="Folder of new captures while the .blend is not saved; empty: WildCap in your home folder, which "
        "no cloud copies",
    )

    switchlight_key: bpy.props.StringProperty(
        name="SwitchLight Key",
        subtype='PASSWORD',
        description="Your key for SwitchLight, a paid service. Blender keeps it readable in its preferences file; an "
        "environment variable does not",
    )

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        draw_solver(layout, self)
        layout.prop(self, "python")
        layout.prop(self, "captures")
        draw_key(layout, "SwitchLight Key")
        draw_links(layout)


def draw_solver(layout, preferences) -> None:
    """Draw the state of the solver, and the buttons that install, choose and remove one."""
    ready = python() is not None
    device = DEVICES.get(preferences.device, preferences.device)
    if ready and device:
        layout.label(text=iface_("The solver is ready ({})").format(device), translate=False, icon='CHECKMARK')
        if preferences.device_reason:
            layout.label(text=preferences.device_reason, translate=False)
    else:
        layout.label(
            text="The solver is ready" if ready else "The solver is not installed",
            icon='CHECKMARK' if ready else 'INFO',
        )
    if ready and preferences.tested:
        layout.label(text=preferences.tested, translate=False, icon='CHECKMARK')
    column = layout.column()
    column.use_property_split = True
    column.prop(preferences, "compute")
    column.prop(preferences, "packages")
    if preferences.packages == 'folder':
        column.prop(preferences, "wheels")
    column.prop(preferences, "environment", text="Folder")
    column = layout.column(align=True)
    if ready:
        column.operator("wildcap.self_test", icon='PLAY')
    column.operator("wildcap.install_solver", icon='IMPORT')
    column.operator("wildcap.use_python", icon='FILE_FOLDER')
    column.operator("wildcap.remove_solver", icon='TRASH')


def draw_links(layout) -> None:
    """Draw the links to WildCap's pages that are set."""
    row = layout.row()
    for text, address in (("Website", links.WEBSITE), ("Report a Problem", links.REPORTS)):
        if address:
            row.operator("wm.url_open", text=text, icon='URL').url = address


def draw_key(layout, label: str) -> None:
    """Draw the source of SwitchLight's key."""
    if os.environ.get(switchlight_api.KEY_VARIABLE):
        text = iface_("The key comes from the environment variable {}").format(switchlight_api.KEY_VARIABLE)
        layout.label(text=text, translate=False, icon='CHECKMARK')
    else:
        layout.prop(get(), "switchlight_key", text=label)


def get() -> WILDCAP_AP_preferences:
    return bpy.context.preferences.addons[extension.NAME].preferences


def switchlight_key() -> str:
    """Return the key of SwitchLight, that of the environment first; '' for none."""
    return os.environ.get(switchlight_api.KEY_VARIABLE) or get().switchlight_key


def worker_environment(delighter: str) -> dict[str, str]:
    """Return the environment variables of a worker: SwitchLight's gets the key, and whether Blender is offline."""
    if delighter != "switchlight":
        return {}
    offline = {} if bpy.app.online_access else {switchlight_api.OFFLINE_VARIABLE: "1"}
    return {switchlight_api.KEY_VARIABLE: switchlight_key(), **offline}


def require_online(otherwise: str) -> None:
    """Raise Problem if Blender is set to work offline; `otherwise` is the alternative, as the end of a sentence."""
    if not bpy.app.online_access:
        where = "" if bpy.app.online_access_override else " (Preferences, System, Network)"
        raise Problem("Blender is set to work offline.", f"Allow online access{where}, or {otherwise}.")


def python() -> Path | None:
    """Return the solver's Python, if it is set, exists and has not failed."""
    path = bpy.path.abspath(get().python)
    return Path(path) if path and path not in _aside and Path(path).is_file() else None


def require_python() -> Path:
    """Return the solver's Python. Raises Problem if there is none."""
    path = python()
    if path is None:
        raise Problem(
            "The solver is not set up on this machine.",
            "Click Install Solver in the Setup panel, or Use an Existing Python.",
        )
    return path


def set_aside(path: Path) -> None:
    """Ignore a Python that does not answer, until it is chosen or installed again."""
    _aside.add(str(path))


def set_python(path: Path | None, device: str = "", reason: str = "") -> None:
    """Set the solver's Python, the device that it computes on, and why."""
    _aside.discard(str(path))
    if get().python != str(path or ""):
        get().tested = ""
    get().python, get().device, get().device_reason = str(path or ""), device, reason
    bpy.context.preferences.is_dirty = True  # Blender saves preferences on exit


def environment_folder() -> Path:
    """Return the folder of Install Solver's environment, outside the extension's own files, which updates replace."""
    path = get().environment
    return Path(bpy.path.abspath(path)) if path else environment.default_folder()


def wheels_folder() -> Path | None:
    """Return the folder of wheels to install from; None if packages come from elsewhere.

    Raises Problem if it has no wheels.
    """
    if get().packages != 'folder':
        return None
    folder = Path(bpy.path.abspath(get().wheels))
    if not get().wheels or not any(folder.glob("*.whl")):
        raise Problem(
            f"There are no wheels in {folder if get().wheels else 'a folder that is not chosen'}.",
            "Choose the folder that `python -m core wheels` made, in the extension's preferences under Wheels.",
        )
    return folder


def captures_folder(saved: bool = True) -> Path:
    """Return the .blend's folder; while it is unsaved (or with saved=False), the preferences' folder or the default."""
    if bpy.data.filepath and saved:
        return Path(bpy.data.filepath).parent
    path = get().captures
    return Path(bpy.path.abspath(path)) if path else captures_default()


def captures_default() -> Path:
    """Return WildCap in the user's home: clouds copy Documents and Desktop, and a capture is large and personal."""
    return Path.home() / "WildCap"


register, unregister = bpy.utils.register_classes_factory((WILDCAP_AP_preferences,))

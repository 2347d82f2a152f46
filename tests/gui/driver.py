# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays an artist in a real Blender window: moves the mouse, clicks, types, and looks at what the screen shows. What an
artist would do with hands is counted.

A flow is a generator that yields seconds to wait: between two events Blender must get its event loop back, so one
application timer runs the generator. Positions are window pixels from the lower left.
"""

import ctypes
import os
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bpy

OUT = Path(os.environ["WILDCAP_GUI_OUT"])
TICK_S = 0.04
STARTED = time.monotonic()
_actions = 0


def play(flow, limit_s: float = 600) -> None:
    """Runs the generator to its end and leaves Blender: exit code 0 and FLOW PASSED, or 1, a traceback and a
    screenshot."""
    survive_lost_contexts()
    bpy.context.preferences.view.show_splash = False
    # there is no window manager to place a second window
    bpy.context.preferences.view.filebrowser_display_type = 'SCREEN'
    bpy.context.preferences.use_preferences_save = False

    def step():
        try:
            if time.monotonic() - STARTED > limit_s:
                raise TimeoutError(f"the flow took longer than {limit_s} s")
            return next(flow) or TICK_S
        except StopIteration:
            say("FLOW PASSED")
            leave(0)
        except BaseException:
            traceback.print_exc(file=sys.stdout)
            screenshot("failure")
            leave(1)

    bpy.app.timers.register(step, first_interval=1.0, persistent=True)


def survive_lost_contexts() -> None:
    """Has Cycles make no OpenGL contexts of its own, and lets an X error pass, which ends Blender by default. To show a
    render Cycles changes contexts in its thread while the main one draws: with Mesa's software renderer the X server
    then answers GLXBadContext now and then, or the main thread crashes for want of one. The error handler is in C: one
    in Python would need the interpreter's lock.
    """
    import _cycles
    import cycles

    _cycles.init(os.path.dirname(cycles.__file__), bpy.utils.resource_path('USER'), True)
    passing = ctypes.cast(ctypes.CDLL(None).sched_yield, ctypes.c_void_p)
    xlib = ctypes.CDLL("libX11.so.6")
    xlib.XSetErrorHandler.argtypes, xlib.XSetErrorHandler.restype = [ctypes.c_void_p], ctypes.c_void_p
    xlib.XSetErrorHandler(passing)


def act(times: int = 1) -> None:
    """Counts clicks, keys, strokes, and things dropped: what flows do by themselves in place of an artist's hands, they
    count, too."""
    global _actions
    _actions += times


def actions() -> int:
    """How many there were until now."""
    return _actions


def leave(code: int) -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # wm.quit_blender always gives 0


def say(*words) -> None:
    print("|", f"{time.monotonic() - STARTED:6.1f} s", *words, flush=True)


def screenshot(name: str) -> Path:
    """What the X server shows; bpy.ops.screen.screenshot is black with a software renderer."""
    path = OUT / f"{name}.png"
    subprocess.run(["import", "-silent", "-window", "root", str(path)], timeout=30, check=False)
    return path


def window():
    return bpy.context.window_manager.windows[0]


def view():
    return next(area for area in window().screen.areas if area.type == 'VIEW_3D')


def region(kind: str = 'WINDOW'):
    return next(r for r in view().regions if r.type == kind)


def in_view(kind: str = 'WINDOW'):
    return bpy.context.temp_override(window=window(), area=view(), region=region(kind))


def event(kind: str, value: str, position, **keys) -> None:
    window().event_simulate(type=kind, value=value, x=round(position[0]), y=round(position[1]), **keys)


def move(position):
    event('MOUSEMOVE', 'NOTHING', position)
    yield


def click(position):
    act()
    yield from move(position)
    yield from move((position[0] + 1, position[1]))
    event('LEFTMOUSE', 'PRESS', position)
    yield
    event('LEFTMOUSE', 'RELEASE', position)
    yield 0.2


def key(kind: str, **keys):
    """A key pressed over the middle of the 3D view."""
    act()
    event(kind, 'PRESS', middle(), **keys)
    event(kind, 'RELEASE', middle(), **keys)
    yield 0.4


def stroke(points, **keys):
    """The left button held down along the points."""
    act()
    first, *others = points
    yield from move(first)
    event('LEFTMOUSE', 'PRESS', first, **keys)
    yield
    for point in others:
        event('MOUSEMOVE', 'NOTHING', point, **keys)
        yield 0.02
    event('LEFTMOUSE', 'RELEASE', others[-1], **keys)
    yield 0.5


def middle():
    r = region()
    return r.x + r.width / 2, r.y + r.height / 2


def park():
    """Takes the cursor off every button: a hovered one keeps its old state. A file browser in place of the 3D view
    needs none of that."""
    if not any(area.type == 'VIEW_3D' for area in window().screen.areas):
        return
    x, y = middle()
    yield from move((x - 200, y))
    yield from move((x - 202, y))
    yield 0.3


TO_THE_TOP = -60
"""Turns of the wheel that bring the longest sidebar back to its top."""


def scroll(steps: int):
    """Turns the wheel over the sidebar, back for negative steps, and has it drawn."""
    sidebar = region('UI')
    position = sidebar.x + sidebar.width // 3, sidebar.y + sidebar.height // 2
    yield from move(position)
    for _ in range(abs(steps)):
        event('WHEELDOWNMOUSE' if steps > 0 else 'WHEELUPMOUSE', 'PRESS', position)
        yield 0.05
    sidebar.tag_redraw()
    yield from park()
    yield 0.5


def open_tab(name: str):
    """Shows the sidebar on one tab, which exists only after it was drawn once, and takes the cursor off it. An artist
    presses N and clicks on the tab."""
    act(2)
    view().spaces.active.show_region_ui = True
    for _ in range(100):
        yield
        sidebar = region('UI')
        if sidebar.width > 10:
            try:
                sidebar.active_panel_category = name
            except TypeError:
                pass
            if sidebar.active_panel_category == name:
                sidebar.tag_redraw()
                yield 0.3
                yield from park()
                return
            sidebar.tag_redraw()
    raise AssertionError(f"the tab {name} never appeared")


def press(command: str, options: str = ""):
    """Clicks the first button of the sidebar that runs an operator, e.g. wildcap.solve, with `options` in its call."""
    position = yield from find(command, options)
    yield from click(position)
    yield from park()


def find(command: str, options: str = ""):
    """Where that button is: the cursor goes down the sidebar and Blender says what would be copied at each place. If it
    is not to be seen, the sidebar is scrolled to its top and then down."""
    for steps in (0, TO_THE_TOP, 16, 16):
        yield from scroll(steps)
        sidebar = region('UI')
        for share in (0.25, 0.45, 0.75, 0.83):  # three buttons may share a row, and the last may be a mere icon
            x = sidebar.x + sidebar.width * share
            for y in range(sidebar.y + sidebar.height - 4, sidebar.y + 4, -11):
                yield from move((x, y))
                text = under_cursor()
                if command in text and options in text:
                    return x, y
        yield 0.5
    raise AssertionError(f"there is no button for {command} {options} in the sidebar")


def lead(command: str):
    """Clicks the sidebar's first button, which must be the one that runs this operator: what a newcomer does who reads
    nothing."""
    yield from scroll(TO_THE_TOP)
    sidebar = region('UI')
    for y in range(sidebar.y + sidebar.height - 4, sidebar.y + 4, -11):
        position = sidebar.x + sidebar.width * 0.5, y
        yield from move(position)
        text = under_cursor()
        if "bpy.ops." in text:
            assert command in text, f"the first button is {text}, not {command}"
            yield from click(position)
            yield from park()
            return
    raise AssertionError(f"no button leads, where {command} should")


def browse(path: Path):
    """Chooses a file or a folder in the file browser that a button has opened in place of the window's areas. An artist
    clicks on it, and on the button below: which folder is shown at first, and how far it is from there, depends on the
    machine."""
    act(2)
    yield from until(lambda: any(area.type == 'FILE_BROWSER' for area in window().screen.areas), "the file browser", 10)
    area = next(area for area in window().screen.areas if area.type == 'FILE_BROWSER')
    yield 1.0
    folder = path if path.is_dir() else path.parent
    area.spaces.active.params.directory = os.fsencode(f"{folder}/")
    if path != folder:  # a browser for folders has no name to fill in
        area.spaces.active.params.filename = path.name
    yield 0.5
    with bpy.context.temp_override(
        window=window(), area=area, region=next(r for r in area.regions if r.type == 'WINDOW')
    ):
        bpy.ops.file.execute()
    yield from until(lambda: any(area.type == 'VIEW_3D' for area in window().screen.areas), "the 3D view", 10)
    yield 1.0


def under_cursor() -> str:
    """The Python call of the button under the cursor, '' if there is none."""
    manager = bpy.context.window_manager
    manager.clipboard = ""
    with in_view('UI'):
        if bpy.ops.ui.copy_python_command_button.poll():
            try:
                bpy.ops.ui.copy_python_command_button()
            except RuntimeError:
                pass
    return manager.clipboard


def until(condition, what: str, limit_s: float = 60, every_s: float = 0.2):
    """Waits until `condition()` is true."""
    end = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, f"{what} did not happen within {limit_s} s"
        yield every_s

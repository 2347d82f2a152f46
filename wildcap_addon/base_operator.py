# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Base classes of the operators: errors become problems in the panel, buttons explain why they are disabled."""

from pathlib import Path

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..core.capture import unforeseen
from ..core.capture.messages import Problem
from . import captures, jobs, problems, status

WIDTH_PX = 460
"""Width of a dialog, pixels."""


class BaseOperator:
    """Operator that does its work in `work(context)` and raises Problem for what the artist can correct."""

    bl_options = {'REGISTER'}

    def __init_subclass__(cls, **options):
        """Use the docstring as the tooltip: one line, without the full stop."""
        super().__init_subclass__(**options)
        if cls.__doc__:
            cls.bl_description = " ".join(cls.__doc__.split()).removesuffix(".")

    @classmethod
    def allowed(cls, condition, why_not: str) -> bool:
        """Return whether the condition holds; if not, give the disabled button's tooltip the reason. For `poll`."""
        if not condition:
            cls.poll_message_set(iface_(why_not))
        return bool(condition)

    @classmethod
    def in_object_mode(cls, context) -> bool:
        """Allow Object Mode only: data-blocks must not appear in the middle of a stroke. For `poll`."""
        return cls.allowed(context.mode == 'OBJECT', "This works in Object Mode only: leave painting or editing first")

    @classmethod
    def with_capture(cls, context) -> bool:
        return cls.allowed(
            captures.active(context) is not None,
            "There is no face to work on yet: choose a video, or open the sample head",
        )

    def execute(self, context):
        root = captures.root(captures.active(context))
        try:
            self.work(context)
        except Problem as problem:
            return self._refuse(root, problem)
        except Exception as error:  # the one place that catches everything: an artist reads problems, not tracebacks
            log = Path(root) / "logs" / unforeseen.LOG if root else None
            return self._refuse(root, unforeseen.explain(error, self.bl_label, log))
        for key in ("", root, captures.root(captures.active(context))):
            problems.clear(key)
        status.refresh(context)
        return {'FINISHED'}

    def work(self, context):
        raise NotImplementedError

    def warn(self, text: str) -> None:
        """Report something that does not stop the work; '' for nothing."""
        if text:
            self.report({'WARNING'}, rpt_(text))

    def _refuse(self, root: str, problem: Problem):
        problems.show(root, problem)
        self.report({'ERROR'}, f"{rpt_(problem.problem)} {rpt_(problem.remedy)}")
        return {'CANCELLED'}


class CaptureOperator(BaseOperator):
    """Operator on the active capture."""

    @classmethod
    def poll(cls, context):
        return cls.with_capture(context)


class HeadOperator(BaseOperator):
    """Operator that makes or changes the active capture's objects in the scene."""

    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return cls.in_object_mode(context) and cls.with_capture(context)


class JobOperator(BaseOperator):
    """Operator that starts a job on the active capture."""

    @classmethod
    def poll(cls, context):
        return jobs.can_start(cls, context)


class FileOperator(BaseOperator):
    """Operator that asks for a file or folder first."""

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}


class Dialog(BaseOperator):
    """Operator that asks for confirmation; `tell()` returns the dialog's lines, or None while they are prepared."""

    lines: tuple[str, ...] = ()

    def invoke(self, context, event):
        try:
            self.lines = self.tell()
        except Problem as problem:
            return self._refuse(captures.root(captures.active(context)), problem)
        if self.lines is None:
            return {'CANCELLED'}
        title = f"{iface_(self.bl_label, 'Operator')}?"
        return context.window_manager.invoke_props_dialog(
            self, width=WIDTH_PX, title=title, confirm_text=self.bl_label.partition(" ")[0]
        )

    def draw(self, context):
        for line in self.lines:
            problems.draw_text(self.layout, line, WIDTH_PX)

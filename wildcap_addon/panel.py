# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tab: a line of state, the button for the next step, running jobs, and a row per stage."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.capture import stages
from . import batches, captures, jobs, next_step, preferences, problems, status, tones
from .base_panel import CapturePanel, FoldedPanel, WildcapPanel, region_width
from .paint import session

STATE_ICONS = {
    "done": 'CHECKMARK',
    "absent": 'CHECKMARK',
    "stale": 'FILE_REFRESH',
    "older": 'TIME',
    "to do": 'RADIOBUT_OFF',
    "not needed": 'BLANK1',
    "running": 'PLAY',
}


class WILDCAP_PT_main(WildcapPanel, bpy.types.Panel):
    bl_label = "WildCap"

    def draw(self, context):
        layout, width = self.layout, region_width(context)
        item = captures.active(context)
        root = captures.root(item)
        step = next_step.next_step(gather(context, item), iface_)
        if item is not None:
            layout.label(text=item.name, icon='USER')
        problems.draw_text(layout, step.state, width)
        job = jobs.of(root) or jobs.of("")
        if job is not None:
            draw_job(layout, job, "wildcap.cancel" if session.active() else "")  # the large button leaves the painting
        if step.operator:
            row = layout.row()
            row.scale_y = 2.0
            row.operator(step.operator, text=step.label, icon=step.icon)
        if step.alternative:
            label, operator, icon = step.alternative
            layout.operator(operator, text=label, icon=icon)
        if step == next_step.SET_UP:
            layout.operator("wildcap.use_python", icon='FILE_FOLDER')
        if item is None:
            layout.operator("wildcap.open_sample_head", icon='USER')
        capture_status = status.of(item) if item is not None else None
        status_problem = capture_status.problem if capture_status else None
        problems.draw(layout, problems.of(root) or problems.of("") or status_problem, width)
        for folder, other in jobs.elsewhere(root):
            box = layout.box()
            box.label(text=Path(folder).stem, icon='USER')
            draw_job(box, other)
            box.operator("wildcap.cancel", icon='CANCEL').capture = folder


class WILDCAP_PT_stages(CapturePanel, bpy.types.Panel):
    bl_label = "Stages"
    bl_order = 5

    def draw(self, context):
        item = captures.active(context)
        capture_status, job = status.of(item), jobs.of(captures.root(item))
        column = self.layout.column(align=True)
        # whether the first stage that is to do gets a button
        ready = bool(capture_status and (capture_status.source or capture_status.has_head))
        for stage in stages.STAGES:
            if stage.only_with and not len(item.layers):
                continue
            state = "running" if job and job.stage == stage.name else _state(capture_status, stage.name)
            split = column.split(factor=0.47)
            split.label(text=stage.label, icon=STATE_ICONS[state])
            row = split.row()
            row.label(text=_words(state, capture_status, stage.name))
            if state == "running" and job.progress and job.progress.of > 0:
                row.label(text=f"{_share(job.progress):.0%}")
            if job is None and (state in ("done", "stale", "older") or state == "to do" and ready):
                icon = 'PLAY' if state == "to do" else 'FILE_REFRESH'
                if stage.name == "solve":
                    row.operator("wildcap.solve", text="", icon=icon, emboss=False)
                else:
                    row.operator("wildcap.reconstruct", text="", icon=icon, emboss=False).first = stage.name
            ready = ready and state not in ("to do", "running")


class WILDCAP_PT_doctor(FoldedPanel, bpy.types.Panel):
    """Problems of the video and how to film it again, as in the report."""

    bl_label = "Video Doctor"
    bl_order = 4

    @classmethod
    def poll(cls, context):
        item = captures.active(context)
        capture_status = status.of(item) if item is not None else None
        return capture_status is not None and bool(capture_status.findings)

    def draw_header(self, context):
        self.layout.label(text="", icon='ERROR')

    def draw(self, context):
        layout, width = self.layout, region_width(context)
        for finding in status.of(captures.active(context)).findings:
            problems.draw_text(layout.column(), finding["problem"], width, 'CANCEL' if finding["stopped"] else 'ERROR')
            problems.draw_text(layout.column(), finding["remedy"], width, 'INFO')
        layout.operator("wildcap.open_report", icon='URL')


def gather(context, item) -> next_step.Facts:
    """Return the input of the next step, without touching the disk."""
    has_python = preferences.python() is not None
    if item is None:
        return next_step.Facts(has_python=has_python, running=jobs.of("").goal if jobs.of("") else "")
    root, head = captures.root(item), captures.head(context, item)
    job = jobs.of(root) or jobs.of("")
    if job is None:
        running = "batch" if batches.works_on(root) else ""
    else:
        running = "wait" if job.waiting else job.goal
    return next_step.Facts(
        has_capture=True,
        has_python=has_python,
        running=running,
        painting=session.painted_kind(),
        head_time=head.get("wildcap_head_time", 0.0) if head else -1.0,
        maps_time=head.get("wildcap_maps_time", -1.0) if head else -1.0,
        asks_tone=tones.asks(item),
        status=status.of(item),
    )


def draw_job(layout, job: jobs.Job, cancel: str = "") -> None:
    """Draw a job's stage, progress and time left; beside it a small button for the operator `cancel`."""
    progress = job.progress
    factor = _share(progress) if progress and progress.of > 0 else 0.0
    row = layout.row(align=True)
    row.progress(text=f"{iface_(jobs.stage_label(job))}  {factor:.0%}", translate=False, factor=factor)
    if cancel:
        row.operator(cancel, text="", icon='CANCEL')
    column = layout.column(align=True)
    column.scale_y = 0.8
    for line in (iface_(progress.text) if progress and progress.text else "", jobs.eta(job)):
        if line:
            column.label(text=line[:1].upper() + line[1:], translate=False)


def _share(progress) -> float:
    return min(1.0, progress.done / progress.of)


def _state(capture_status: status.Status | None, stage: str) -> str:
    state = capture_status.stages.get(stage, "to do") if capture_status else "to do"
    # the sample head comes without what it was made from
    is_sample = capture_status and capture_status.has_head and not capture_status.source
    return "not needed" if state == "to do" and is_sample and stage in next_step.BEFORE_MASK else state


def _words(state: str, capture_status: status.Status | None, stage: str) -> str:
    if state == "older":
        return iface_("made by {}").format(capture_status.versions[stage])
    seconds = capture_status.seconds.get(stage) if capture_status else None
    if state in ("done", "stale") and seconds is not None:
        time = f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
        return (iface_("done, {}") if state == "done" else iface_("out of date, {}")).format(time)
    return {"absent": "done", "stale": "out of date"}.get(state, state)


register, unregister = bpy.utils.register_classes_factory((WILDCAP_PT_main, WILDCAP_PT_doctor, WILDCAP_PT_stages))

# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What takes longer than a redraw may: done in slices between a window's events, with progress and Esc."""

import sys
from time import perf_counter

import bpy
from bpy.props import BoolProperty

from ..touch.settings import UNSAVED
from .operators import report_error, target_object

FIRST_SLICE = 0.2  # seconds of work before a window is told that there is more
TIMER_SLICE = 0.03  # seconds of work between two events
SAY = 1.0  # seconds between two lines of progress where there is no window
NEXT = 0.01  # seconds from one slice to the next


class InSlices:
    """Mixed into operators whose work is a generator.

    Each has `_begin(context)`, which sets `_steps`; `_check(context)`, called before each slice, as the scene
    may have changed; `_done()`, words and the share that is done, or None; and `_finish(context)`. All but
    `_done` may raise ValueError, with a sentence for the user.
    """

    progress: BoolProperty(
        name="Progress",
        description="Print progress to stderr where there is no window to show it",
        options={"HIDDEN", *UNSAVED},
    )

    _timer = None  # while it is running in a window
    _in_window = False  # whether a dialog has been agreed to, after which it goes on in slices
    stop = "Stop"  # what Esc does
    meanwhile = {"RUNNING_MODAL"}  # what becomes of all other events

    def invoke(self, context, event):
        try:
            self._begin(context)
            if self._advance(context, FIRST_SLICE):
                return self._finish(context)
        except ValueError as error:
            return report_error(self, error)
        return self._go_on(context)

    def _ask(self, context):
        """A dialog before it begins, which names the mesh to touch."""
        if bpy.app.background:
            return self.execute(context)
        self._in_window = True
        try:
            self.target = target_object(context, self.target).name
        except ValueError as error:
            return report_error(self, error)
        return context.window_manager.invoke_props_dialog(self, confirm_text="Touch")

    def execute(self, context):
        try:
            self._begin(context)
            if self._in_window:
                return self._go_on(context)
            self._check(context)
            said = perf_counter()
            for _ in self._steps:
                if self.progress and perf_counter() > said + SAY:
                    said = perf_counter()
                    print(self._done()[0], file=sys.stderr, flush=True)
            return self._finish(context)
        except ValueError as error:
            return report_error(self, error)

    def _go_on(self, context):
        """Has the window do the steps."""
        self._timer = context.window_manager.event_timer_add(NEXT, window=context.window)
        context.workspace.status_text_set(_status(self.stop, *self._done()))
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            return self._stopped(context)
        if event.type != "TIMER":
            return self.meanwhile
        try:
            if not self._advance(context, TIMER_SLICE):
                context.workspace.status_text_set(_status(self.stop, *self._done()))
                return self.meanwhile
            self._leave(context)
            return self._finish(context)
        except ValueError as error:
            self._leave(context)
            return report_error(self, error)

    def _advance(self, context, seconds):
        """Works so long; whether all is done then."""
        self._check(context)
        end = perf_counter() + seconds
        return not any(perf_counter() > end for _ in self._steps)

    def _check(self, context):
        """Nothing that happens meanwhile matters."""

    def _stopped(self, context):
        self._leave(context)
        self.report({"INFO"}, "Stopped: the patch stays as it was")
        return {"CANCELLED"}

    def _leave(self, context):
        """Takes away all that shows that it is going on."""
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            context.workspace.status_text_set(None)
            self._timer = None

    def cancel(self, context):
        """Blender's, where it ends the operator itself: by a dialog, a new file or a closed window."""
        if self._timer is not None:
            self._leave(context)
            print(f"{self.bl_label}: stopped because the file or the window was closed", file=sys.stderr)


def _status(stop, words, share=None):
    """What draws the status bar meanwhile; it may outlive the operator by a redraw."""

    def draw(header, context):
        layout = header.layout
        layout.label(text="", icon="EVENT_ESC")
        layout.label(text=f" {stop}")
        if share is None:
            layout.label(text=words, translate=False)
        else:
            row = layout.row()
            row.ui_units_x = 16
            row.progress(factor=share, text=words, translate=False)
        layout.separator_spacer()

    return draw

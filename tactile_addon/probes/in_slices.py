# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work that is done in slices between a window's events, with progress and Esc."""

import sys
import textwrap
from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Any, TypeAlias

import bpy
from bpy.props import BoolProperty

from ..scene.viewports import redraw
from ..touch.settings import TARGET, UNSAVED, draw_chosen
from ..touch.types import Object, OperatorMixin, Outcome
from ..touch.units import duration
from ..touch.wording import sentence
from .operators import has_target, is_in_object_mode, report_error, reports_errors, target_object, waiting

# These are seconds.
FIRST_SLICE = 0.2  # Work that takes no longer is done without slices.
TIMER_SLICE, LONGEST_SLICE = 0.03, 0.25  # The least and longest work between two events: as a redraw takes.
NEXT = 0.01  # The next slice begins after this time.
LITTLE = 0.05  # The time that is left is said from this share on.
LETTERS = 44  # About how many letters fit into a line of a dialog.
SAY = 1.0  # Without a window, a line of progress is printed each time.
Progress: TypeAlias = tuple[str, float | None]  # Words, and the share that is done, if it is known.


class InSlices(OperatorMixin):
    """For operators whose work is a generator to inherit.

    Each has `_begin(context)`, which sets `_steps`; `_check(context)`, called before each slice, because the
    scene may have changed; `_done()`, which gives words and the share that is done, or None; and
    `_finish(context)`. All but `_done` may raise ValueError, with a sentence for the user.
    """

    progress: BoolProperty(
        name="Progress",
        description="Print progress to stderr where there is no window to show it",
        options={"HIDDEN", *UNSAVED},
    )

    _steps: Iterator[Any]
    _share: Any = 0.0  # What the steps yielded last: the share that is done, if they yield that.
    _begin: Callable[[bpy.types.Context], None]
    _done: Callable[[], Progress]
    _finish: Callable[[bpy.types.Context], Outcome]
    _timer: bpy.types.Timer | None = None  # There is one while it runs in a window.
    _begun = _worked = 0.0  # When the first slice began, and when the last one ended.
    _is_asked = False  # Whether the panel's button was pressed, which does what Esc does.
    _in_window = False  # Whether a dialog was confirmed, after which it goes on in slices.
    stop = "Stop"  # What Esc does,
    stopped = "Stopped: the patch stays as it was"  # and what is reported then.
    meanwhile = {"RUNNING_MODAL"}  # What modal() returns for all other events.
    section = "object"  # The part of the panel that shows how far it is: "object" or "map".
    shown: tuple[str, ...] = ()  # The settings in its dialog; "target" is the name of an object.

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        try:
            self._begin(context)
            if self._advance(context, FIRST_SLICE):
                return self._finish(context)
        except ValueError as error:
            return report_error(self, error)
        return self._go_on(context)

    def _confirm(self, context: bpy.types.Context, text: str) -> Outcome:
        """Asks in a dialog, whose button has this text, before it begins."""
        if bpy.app.background:
            return self.execute(context)
        self._in_window = True
        return context.window_manager.invoke_props_dialog(self, confirm_text=text)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        with waiting(context):
            self._begin(context)
        if self._in_window:
            return self._go_on(context)
        self._check(context)
        self._begun = said = perf_counter()
        for share in self._steps:
            self._share = share
            if self.progress and perf_counter() > said + SAY:
                said = perf_counter()
                print(self._done()[0], file=sys.stderr, flush=True)
        return self._finish(context)

    def _go_on(self, context: bpy.types.Context) -> Outcome:
        """Starts a timer in the window, whose events do the rest of the steps in `modal`."""
        _running.append(self)
        self._begun = perf_counter()
        self._timer = context.window_manager.event_timer_add(NEXT, window=context.window)
        context.workspace.status_text_set(_draw_status)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        if self._is_asked or (event.type == "ESC" and event.value == "PRESS"):
            self._is_asked = False
            return self._stopped(context)
        if event.type != "TIMER":
            return self.meanwhile
        try:
            if not self._advance(context, self._slice()):
                context.workspace.status_text_set(_draw_status)  # This has it drawn again.
                redraw(context, "UI")
                return self.meanwhile
            self._leave(context)
            return self._finish(context)
        except ValueError as error:
            self._leave(context)
            return report_error(self, error)

    def _slice(self) -> float:
        """How long to work: where redraws are slow, as without a graphics card, half of the time."""
        return min(max(perf_counter() - self._worked, TIMER_SLICE), LONGEST_SLICE)

    def _advance(self, context: bpy.types.Context, seconds: float) -> bool:
        """Works for some seconds, and returns whether all is done then."""
        self._check(context)
        end = perf_counter() + seconds
        for share in self._steps:
            self._share = share
            if perf_counter() > end:
                self._worked = perf_counter()
                return False
        # `_finish` has a slice of its own, because the last step and the new object may take long together.
        return self._timer is None or perf_counter() < end - 0.5 * seconds

    def _check(self, context: bpy.types.Context) -> None:
        """Accepts whatever happens meanwhile, unless an operator overrides it."""

    def _said(self) -> Progress:
        """What `_done` gives, and the time that is left, once a little is done."""
        words, share = self._done()
        if share is None or share < LITTLE:
            return words, share
        left = (perf_counter() - self._begun) * (1.0 / share - 1.0)
        return f"{words}, {duration(left)} left", share

    def _stopped(self, context: bpy.types.Context) -> Outcome:
        self._leave(context)
        self.report({"INFO"}, self.stopped)
        return {"CANCELLED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the settings that are `shown`."""
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        for name in self.shown:
            if name == "target":
                layout.prop_search(self, name, context.scene, "objects")
            else:
                draw_chosen(layout, self, name)

    def _leave(self, context: bpy.types.Context) -> None:
        """Removes everything that shows that it is going on."""
        if self._timer is not None:
            _running.remove(self)
            redraw(context, "UI")
            context.window_manager.event_timer_remove(self._timer)
            context.workspace.status_text_set(None)
            self._timer = None

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender calls it when it ends the operator itself: by a dialog, a new file or a closed window."""
        if self._timer is not None:
            self._leave(context)
            print(f"{self.bl_label}: stopped because the file or the window was closed", file=sys.stderr)


_running: list[InSlices] = []  # What runs in a window now, the latest last.


class TACTILE_OT_stop(bpy.types.Operator):
    """Do what Esc does while an object is touched"""

    bl_idname = "tactile.stop"
    bl_label = "Stop"

    def execute(self, context: bpy.types.Context) -> Outcome:
        for operator in _running[-1:]:
            operator._is_asked = True
        return {"FINISHED"}


def draw_running(layout: bpy.types.UILayout, section: str | None = None) -> None:
    """Draws how far the latest operator is that runs in slices, and a button that stops it; or nothing.

    section : the part of the panel that is drawn, which leaves the operators of others out
    """
    for operator in _running[-1:]:
        if section not in (None, operator.section):
            continue
        words, share = operator._said()
        layout.progress(factor=share or 0.0, text=words, translate=False)
        layout.operator(TACTILE_OT_stop.bl_idname, text=operator.stop, icon="EVENT_ESC")


def _draw_status(header: Any, context: bpy.types.Context) -> None:
    """Draws the same in the status bar; it may outlive the operator by a redraw."""
    row = header.layout.row()
    row.ui_units_x = 30
    draw_running(row)


class AllOver(InSlices):
    """For operators that touch a mesh all over to inherit; a dialog names the mesh before they begin.

    Each has `_estimate(context, target)`, a sentence on what it will take, which may raise ValueError, with a
    sentence.
    """

    target: TARGET

    meanwhile = {"PASS_THROUGH"}  # The scene may change, because a detached mesh is touched.
    _estimate: Callable[[bpy.types.Context, Object], str]
    _known: tuple[Any, str] = ((), "")  # What was estimated last, after what it depends on.

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        try:
            self.target = target_object(context, self.target).name
            with waiting(context):
                self._about(context)
        except ValueError as error:
            return report_error(self, error)
        return self._confirm(context, "Touch")

    def _about(self, context: bpy.types.Context) -> str:
        """A sentence on what it will take with these settings, made once: a dialog is drawn often."""
        target = target_object(context, self.target)
        mesh = target.evaluated_get(context.evaluated_depsgraph_get()).data
        shape = target.session_uid, len(getattr(mesh, "vertices", ()))  # A modifier may have been added.
        given = *shape, *(getattr(self, name) for name in self.shown)
        self._is_reshaped = self._known[0][:2] != shape
        if given != self._known[0]:
            self._known = given, self._estimate(context, target)
        return self._known[1]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_in_object_mode(cls, context, "Objects are touched") and has_target(cls, context)

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the settings, and what it will take with them."""
        super().draw(context)
        try:
            words = self._about(context)
        except ValueError as error:
            words = sentence(error)
        for line in textwrap.wrap(words, LETTERS):
            self.layout.label(text=line, translate=False)

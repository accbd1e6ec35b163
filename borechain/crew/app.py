"""The crew's screen: shows what the picture holds, takes keys, and has orders carried out beside everything else."""

from __future__ import annotations

import datetime
import queue
import time
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Protocol

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Input, Static

from borechain.client import ClientError
from borechain.crew import screen_panels
from borechain.crew.checks_panel import checks_panel
from borechain.crew.picture import PATHS, Picture, View
from borechain.crew.reply_panel import reply_panel
from borechain.crew.setup_panel import parse_order, setup_panel
from telemetry.errors import BorechainError

REFRESH = 0.25  # s
ALARM_ROWS, ACTION_ROWS = 5, 2
SHELVED_FOR = 30  # min


class ScreenSource(Protocol):
    """What the screen needs of a ground station."""

    def ask(self, path: str, **parameters: object) -> View:
        """Answer of a path."""

    def follow(self, path: str, call: Callable[[str, View], object]) -> None:
        """Have every answer that is published handed to ``call``, on any thread."""

    def order(self, name: str, by: str, **parameters: object) -> Any:
        """Order something and wait for the outcome."""


class CrewApp(App[None]):
    """One rig on a screen of 80 x 24.

    Parameters
    ----------
    source : the ground station
    rig : its name
    by : who orders
    clock : s; what is shown is aged by it
    ended : whether there is nothing more to show, and the screen is to close
    """

    CSS = """
    Screen { overflow: hidden; }
    Static { height: auto; width: auto; }
    #verdict { height: 3; margin-bottom: 1; }
    #middle { height: 11; }
    #plan { width: 23; } #strip { width: 27; padding-left: 1; } #string { width: 30; padding-left: 1; }
    #setup, #checks, #reply { height: 11; display: none; }
    #alarms { height: 5; } #actions { height: 2; }
    #order { height: 1; border: none; padding: 0; display: none; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("a", "acknowledge", "acknowledge"),
        Binding("s", "shelve", "shelve"),
        Binding("t", "take_survey", "take survey"),
        Binding("d", "accept_depth", "accept depth"),
        Binding("u", "show_setup", "setup"),
        Binding("w", "show_checks", "what the ± is made of"),
        Binding("o", "type_order", "order"),
        Binding("escape", "leave_order", "leave the order", show=False),
        Binding("down", "choose(1)", "next alarm"),
        Binding("up", "choose(-1)", "previous alarm"),
        Binding("q", "quit", "quit"),
    ]
    HELP = "[a]cknowledge [s]helve [t]ake survey [d]epth ok set[u]p [w]hy ± [o]rder [q]uit"

    def __init__(
        self,
        source: ScreenSource,
        rig: str,
        by: str,
        clock: Callable[[], float] = time.monotonic,
        ended: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__()
        self._ended = ended
        self.picture = Picture(rig)
        self._source = source
        self._by = by
        self._clock = clock
        self._arrived: queue.SimpleQueue[tuple[str, View]] = queue.SimpleQueue()
        self._chosen = 0
        self._is_asking = False
        self._judged: View = {}  # answer of what changed when, that was looked at for what was missed

    def compose(self) -> ComposeResult:
        """The parts of the screen, from the top down."""
        yield Static(id="header")
        yield Static(id="verdict")
        with Horizontal(id="middle"):
            yield Static(id="plan")
            yield Static(id="strip")
            yield Static(id="string")
        yield Static(id="setup")
        yield Static(id="checks")
        yield Static(id="reply")
        yield Static(id="alarms")
        yield Static(id="actions")
        yield Input(
            placeholder="order, such as: north action=tell angle_deg=12 sigma_deg=0.3", id="order", disabled=True
        )
        yield Static(screen_panels.fit_line(self.HELP, screen_panels.QUIET), id="help")

    def on_mount(self) -> None:
        """Follow the ground station from now on."""
        self._source.follow("**", lambda path, view: self._arrived.put((path, view)))
        self._is_asking = True
        self.run_worker(self._ask_all, thread=True)
        self.set_interval(REFRESH, self.paint)
        self.paint()

    def paint(self) -> None:
        """Take what has arrived and show everything as it is now."""
        now = self._clock()
        while not self._arrived.empty():
            path, view = self._arrived.get()
            self.picture.on_answer(path, view, now)
        if not self.query("#help"):
            return  # the screen is being taken down
        if self._ended():
            self.exit()
        picture = self.picture
        self._catch_up()
        for name, text in (
            ("header", screen_panels.header_panel(picture, now)),
            ("verdict", screen_panels.verdict_panel(picture, now)),
            ("plan", screen_panels.plan_panel(picture)),
            ("strip", screen_panels.strip_panel(picture)),
            ("string", screen_panels.string_panel(picture)),
            ("setup", setup_panel(picture, datetime.datetime.now(datetime.UTC))),
            ("checks", checks_panel(picture)),
            ("alarms", screen_panels.alarms_panel(picture, self._chosen, ALARM_ROWS)),
            ("actions", screen_panels.actions_panel(picture, ACTION_ROWS)),
        ):
            self.query_one(f"#{name}", Static).update(text)

    def _catch_up(self) -> None:
        """Ask for what was published and did not arrive, once for each word of what has changed."""
        told = self.picture.answers.get("changes", {})
        if self._is_asking or told is self._judged:
            return
        self._judged = told
        if missed := self.picture.missed:
            self._is_asking = True
            self.run_worker(lambda: self._ask_for(missed), thread=True)

    def action_choose(self, step: int) -> None:
        """Choose another alarm."""
        self._chosen = max(0, min(self._chosen + step, len(self.picture.alarms) - 1))
        self.paint()

    def action_acknowledge(self) -> None:
        """Acknowledge the chosen alarm."""
        self._order_about_alarm("acknowledge")

    def action_shelve(self) -> None:
        """Put the chosen alarm away."""
        self._order_about_alarm("shelve", minutes=SHELVED_FOR)

    def action_take_survey(self) -> None:
        """Have the tube at the bit survey again."""
        if self.picture.lowest is None:
            self._tell("take survey: no tube is known yet")
        else:
            self._order("take_survey", f"take survey of tube {self.picture.lowest}", tube=self.picture.lowest)

    def action_accept_depth(self) -> None:
        """Believe the depth that comes now; the crew has measured it."""
        self._order("accept_depth", "accept depth", action="confirm")

    def action_show_setup(self) -> None:
        """Show the setup in place of plan, strip and string, or those again."""
        self._show("#setup")

    def action_show_checks(self) -> None:
        """Show what the tubes say about each other in place of plan, strip and string, or those again."""
        self._show("#checks")

    def _show(self, name: str) -> None:
        """Show one of the panels in the middle of the screen; what is there already gives way to the first."""
        name = "#middle" if self.query_one(name).display else name
        for panel in ("#middle", "#setup", "#checks", "#reply"):
            self.query_one(panel).display = panel == name

    def action_type_order(self) -> None:
        """Have an order typed in the last line."""
        self._open_order(is_open=True)
        self.query_one("#order", Input).focus()

    def action_leave_order(self) -> None:
        """Close the line without an order, and the reply to one."""
        self._open_order(is_open=False)
        if self.query_one("#reply").display:
            self._show("#reply")

    def on_input_submitted(self, typed: Input.Submitted) -> None:
        """Carry the typed order out."""
        self._open_order(is_open=False)
        try:
            name, parameters = parse_order(typed.value)
        except ValueError as error:
            self._tell(str(error))
            return
        self._order(name, typed.value.strip(), **parameters)

    def _open_order(self, *, is_open: bool) -> None:
        line = self.query_one("#order", Input)
        line.display, self.query_one("#help").display = is_open, not is_open
        line.disabled = not is_open  # keys are those of the screen else
        line.clear()
        if not is_open:
            self.set_focus(None)

    def _order_about_alarm(self, action: str, **more: object) -> None:
        alarms = self.picture.alarms
        if not alarms:
            self._tell(f"{action}: no alarm is open")
            return
        number = alarms[min(self._chosen, len(alarms) - 1)]["number"]
        self._order("alarm", f"{action} alarm {number}", action=action, number=number, **more)

    def _order(self, name: str, shown: str, **parameters: object) -> None:
        """Order on a thread, and show its course."""
        self._tell(f"{shown}: sent")

        def carry_out() -> None:
            try:
                order = self._source.order(name, self._by, **parameters)
                detail = f": {order.detail}" if order.detail else ""
                outcome = f"{shown}: {order.state}{detail}"
                if order.tube is not None and order.values:
                    self.call_from_thread(self._show_reply, outcome, order.values)
            except BorechainError as error:
                outcome = f"{shown}: {error}"
            self.call_from_thread(self._tell, outcome)

        self.run_worker(carry_out, thread=True)

    def _show_reply(self, outcome: str, values: View) -> None:
        """Show what a tube has answered in place of plan, strip and string."""
        panel = self.query_one("#reply", Static)
        panel.update(reply_panel(outcome, values))
        if not panel.display:
            self._show("#reply")

    def _tell(self, line: str) -> None:
        self.picture.done.append(line)
        self.paint()

    def _ask_all(self) -> None:
        """Ask at the beginning for what is not published at once; no answer is no fault."""
        self._ask_for([*PATHS, *(f"nodes/{row['tube']}" for row in self._ask("string").get("tubes", []))])

    def _ask_for(self, paths: Sequence[str]) -> None:
        """Ask for answers that did not come by themselves."""
        for path in paths:
            if view := self._ask(path):
                self._arrived.put((path, view))
        self._is_asking = False

    def _ask(self, path: str) -> View:
        try:
            return self._source.ask(path)
        except ClientError:
            return {}

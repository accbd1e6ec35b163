"""The doors of the ground station: ask, order, upload, recalibrate; the same for every gateway.

A plain object without bus, lock or thread: callers run on the thread that also drives the process.
"""

from __future__ import annotations

import datetime
import itertools
import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from groundstation.config import GroundConfig
from groundstation.errors import ConfigurationError, LeaseError, SelectorError
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import find_path
from groundstation.service.disk.ground_store import Store
from groundstation.service.hole.collar_doubt import collar_doubt
from groundstation.service.orders.blocks import block_of_files
from groundstation.service.orders.order_book import OrderState, SentOrder
from groundstation.service.orders.recalibration.control import Recalibration
from groundstation.service.orders.recalibration.procedure import Request
from groundstation.service.orders.surveyed_biases import surveyed_biases
from groundstation.service.orders.uploads import Uploads
from groundstation.service.setup.setup_orders import SetupOrders
from groundstation.survey.fusion.force_biases import SurveyedBiases
from telemetry.application.arguments import check_arguments, parse_parameters, parse_tube
from telemetry.application.commands import COMMANDS, CommandSpec, ObeyedBy, find_command
from telemetry.errors import CommandError
from telemetry.messages import BlockStatus, Command
from telemetry.parameters import ParameterBlock

START_SHIFT = 20  # orders of one start of the ground station, as a power of two
OPEN_AT_MOST = 16  # orders that wait for the answer of one tube
ANSWERED_WITHIN = 900.0  # s, own clock, after which an order that no tube has answered is withdrawn
NO_KEY = "key_file: expected the key file of the rig, without it no node takes a block"
LONGEST_NAME = 64  # characters, of who orders
UPLOAD = "upload_parameters"
SETUP_COMMANDS = ("north", "collar", "joint", "length", "stick_up", "same_number", "setup")
DOUBTS_OF_DEPTH = ("depth_refused", "depth_contradicts")  # alarms, after which a crew measures the depth again
RECALIBRATION = "recalibration"  # who orders what the calibration in the field asks for


@dataclass(frozen=True, slots=True)
class BlockUpload:
    """A block to send to its tube under the number of its order."""

    number: int
    block: ParameterBlock


Outgoing = Command | BlockUpload


class OperatorAccess:
    """What operators may do, whatever gateway they come in by.

    Parameters
    ----------
    config : of the ground station
    model, store : what is known, for its answers, and where it is kept
    uploads : that are under way; None without a key of the rig
    start : number of this start of the ground station, which no order of another start shares
    """

    def __init__(
        self, config: GroundConfig, model: RigModel, store: Store, uploads: Uploads | None, start: int
    ) -> None:
        self._config = config
        self._model = model
        self._store = store
        self._uploads = uploads
        self._orders, self._string = model.orders, model.string
        self._numbers = itertools.count((start << START_SHIFT) + 1)
        self._pending: deque[Outgoing] = deque()
        self._accepted_at: dict[int, float] = {}  # s, own clock, of the orders that have no answer yet
        self._recalibration = Recalibration(
            model.recalibration, store, config.calibrations, self._cancel_upload, self._surveyed_biases
        )
        doubt = partial(collar_doubt, model.hole, math.radians(config.curvature_std_deg_per_m))
        self._setup = SetupOrders(model.setup, store, lambda: self._string.tubes, self._follow, doubt)
        self._handlers: dict[str, Callable[[SentOrder], None]] = {
            spec.name: self.tell_setup if spec.name in SETUP_COMMANDS else getattr(self, spec.name)
            for spec in COMMANDS
            if spec.by is ObeyedBy.GROUND
        }
        self.follow_setup: Callable[[], int] = lambda: 0  # called when the setup is told anew; how many surveys follow
        self.wake: Callable[[], None] = lambda: None  # called when something is to be sent
        self.ended: Callable[[int], None] = lambda _number: None  # called with an order that is not to be sent any more
        self.barred = ""  # why no order is taken
        self.accepted: Callable[[str, Mapping[str, str], str], None] = lambda _name, _parameters, _by: (
            None
        )  # and obeyed
        self.changed: Callable[[list[str]], None] = lambda _paths: None  # called with the paths that changed

    def ask(self, path: str, parameters: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Answer of the path below ``ground/``, see docs/keys.md.

        Raises
        ------
        SelectorError
            When there is no such path, or a parameter cannot be; it lists what can.
        """
        return find_path(self._model, path).show(self._model, dict(parameters or {}))

    def ask_json(self, path: str) -> bytes:
        """Answer of the path as JSON.

        Raises
        ------
        SelectorError
            When there is no such path.
        """
        return find_path(self._model, path).json(self._model, {})

    def order(self, name: str, parameters: Mapping[str, str], by: str = "operator") -> SentOrder:
        """Accept an order as an operator writes it.

        Raises
        ------
        SelectorError
            When the command, its tube or a parameter cannot be; nothing is sent.
        CalibrationError, ConfigurationError, StoreError
            When the ground station cannot obey; nothing is sent.
        LeaseError
            When it may not be the ground station of the rig any more.
        """
        if self.barred:
            raise LeaseError(self.barred)
        check_name(by)
        try:
            spec = find_command(name, parameters.get("action", ""))
            tube = None if spec.action else parse_tube(spec, parameters)
            arguments = parse_parameters(spec, parameters)
        except CommandError as error:
            raise SelectorError(str(error)) from error
        order = self._accept(spec, tube, arguments, by)
        if spec.by is ObeyedBy.GROUND:
            self.accepted(name, parameters, by)
        return order

    def command(
        self, tube: int, name: str, arguments: Mapping[str, Any] | None = None, by: str = "operator"
    ) -> SentOrder:
        """Accept an order for a tube with arguments in SI.

        Raises
        ------
        SelectorError
            When the command, the tube or an argument cannot be; nothing is sent.
        """
        given = dict(arguments or {})
        try:
            spec = find_command(name)
            check_arguments(spec, given)
        except CommandError as error:
            raise SelectorError(str(error)) from error
        return self._accept(spec, tube, given, by)

    def upload(self, block: ParameterBlock, by: str = "operator") -> SentOrder:
        """Send a block to its tube until the tube has judged it.

        Raises
        ------
        ConfigurationError
            When the ground station has no key of the rig.
        SelectorError
            When the tube is unknown, or a calibration in the field uploads to it: one of the two would never end.
        """
        self._check_key()
        self._check_tube(block.tube)
        order = self._new_order(find_command(UPLOAD), block.tube, {"version": block.version}, by)
        self._start_upload(order, block)
        self._keep(order)
        return order

    def upload_parameters(self, order: SentOrder) -> None:
        """Upload the calibrations that are named, as the version after the one in use unless a version is named."""
        tube, arguments = order.tube or 0, order.arguments
        version, state = arguments.get("version"), self._string.states.newest.get(tube)
        if version is None and state is None:
            raise SelectorError(f"tube {tube}: its state, and so its version, is not known yet; expected version=..")
        if version is None and state is not None:
            version = state.parameters_version + 1
        names = arguments["gyroscope"], arguments["accelerometer"]
        block = block_of_files(self._config.calibrations, tube, int(version or 0), *names)
        self._check_key()
        self._start_upload(order, block)

    def recalibrate(self, order: SentOrder) -> None:
        """Take a step of the calibration in the field."""
        self._check_key()
        self._recalibration.step(order.spec.action, order.arguments, self._string.time.rig_now, self._string.tubes)
        order.advance(OrderState.DONE)
        self.changed(["recalibration"])

    def accept_depth(self, order: SentOrder) -> None:
        """Believe the depth that comes from now on; one that nothing speaks against is not to be accepted blindly.

        Raises
        ------
        SelectorError
            When the depth neither jumped nor is refused, and contradicts nothing.
        """
        doubted = [one for one in self._model.rig_alarms if one.kind.code in DOUBTS_OF_DEPTH]
        if not (self._string.depths.jumped or doubted):
            raise SelectorError("accept_depth: expected a depth that jumped or is refused, nothing speaks against it")
        self._string.depths.accept()
        for subject in [one.subject for one in doubted if one.kind.code == "depth_refused"]:
            self._model.rig_alarms.clear("depth_refused", subject)
        order.advance(OrderState.DONE)

    def accept_joints(self, order: SentOrder) -> None:
        """Take the angles at which the joints stand for right."""
        self._string.joints.accept()
        for alarm in list(self._model.rig_alarms):
            if alarm.kind.code == "joint":
                self._model.rig_alarms.clear("joint", alarm.subject)
        order.advance(OrderState.DONE)

    def tell_setup(self, order: SentOrder) -> None:
        """Take what is told of the setup, or take it back; a bearing taken anew answers the alarm about the encoder."""
        order.advance(OrderState.DONE, self._setup.obey(order))
        if order.spec.name == "north":
            self._model.rig_alarms.clear("reference", "encoder")
        self.changed(["setup", "verdict"])

    def _follow(self) -> int:
        return self.follow_setup()

    def alarm(self, order: SentOrder) -> None:
        """Acknowledge an alarm, shelve it or take it back; kept on the disk before the order is done."""
        alarms, utc = self._model.crew_alarms, time.time()
        number, by = int(order.arguments["number"]), order.by
        match order.spec.action:
            case "acknowledge":
                changed = alarms.acknowledged(number, by, utc)
            case "shelve":
                changed = alarms.shelved(number, by, utc + 60.0 * float(order.arguments["minutes"]))
            case _:
                changed = alarms.unshelved(number)
        self._store.keep_alarms([changed])
        alarms.put(changed)
        order.advance(OrderState.DONE)
        self.changed(["alarms"])

    def expire_orders(self, now: float) -> None:
        """Withdraw what no tube has answered by ``now`` (s, own clock); the calibration in the field minds its own."""
        for order in self._waiting():
            if order.state is OrderState.SENT and now > self._accepted_at.get(order.number, now) + ANSWERED_WITHIN:
                self.ended(order.number)
                if self._uploads is not None and order.spec.name == UPLOAD and order.tube is not None:
                    self._uploads.cancel(order.tube)
                self._orders.fail(order.number, f"tube {order.tube} has not answered in {ANSWERED_WITHIN:.0f} s")
        self._accepted_at = {o.number: self._accepted_at.get(o.number, now) for o in self._waiting()}
        self.publish_orders()

    def reply_of(self, order: SentOrder) -> dict[str, Any]:
        """Answer to the sender of an order: the order, or how far the calibration in the field has come."""
        is_recalibration = order.spec.name == "recalibrate"
        return self.ask("recalibration" if is_recalibration else f"orders/{order.number}")

    def take_pending(self) -> list[Outgoing]:
        """What is to be sent now."""
        pending = list(self._pending)
        self._pending.clear()
        return pending

    @property
    def has_pending(self) -> bool:
        """Whether something is to be sent."""
        return bool(self._pending)

    def due_requests(self, now: float) -> list[Outgoing]:
        """What the calibration in the field asks for at ``now`` (s, own clock); kept before any of it leaves."""
        procedure = self._model.recalibration
        outgoing: list[Outgoing] = []
        for request in procedure.due_requests(now):
            order = self._new_order(
                find_command(request.name), request.tube, _request_arguments(request), RECALIBRATION
            )
            procedure.on_sent(request, order.number)
            self._keep(order, wake=False)
            if request.block is not None:
                outgoing.append(BlockUpload(order.number, request.block))
            else:
                outgoing.append(Command(request.tube, order.number, request.name, request.arguments))
        if self._recalibration.keep_progress():
            self.changed(["recalibration"])
        return outgoing

    def start_upload(self, upload: BlockUpload, now: float) -> None:
        """Begin an upload at ``now`` (s, own clock)."""
        if self._uploads is not None:
            overtaken = self._uploads.start(upload.block, upload.number, now)
            self._orders.fail(overtaken, f"order {upload.number} uploads another block")

    def on_block_status(self, status: BlockStatus) -> None:
        """Handle a tube's status of an upload."""
        ended = self._uploads is not None and self._uploads.on_status(status)
        self._orders.on_block_status(status, ended=ended)
        if ended:
            self._model.recalibration.on_block_status(status, has_surveyed=self._model.hole.has_survey_of(status.tube))

    def publish_orders(self) -> None:
        """Have the orders that changed published."""
        if numbers := self._orders.drain_changed():
            self.changed(["orders", *(f"orders/{number}" for number in numbers)])

    def _accept(self, spec: CommandSpec, tube: int | None, arguments: dict[str, Any], by: str) -> SentOrder:
        if tube is not None:
            self._check_tube(tube)
            self._check_room(tube)
        order = self._new_order(spec, tube, arguments, by)
        if spec.by is ObeyedBy.GROUND:
            self._handlers[spec.name](order)
        elif tube is not None:
            self._pending.append(Command(tube, order.number, spec.name, arguments))
        self._keep(order)
        return order

    def _new_order(self, spec: CommandSpec, tube: int | None, arguments: dict[str, Any], by: str) -> SentOrder:
        utc = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        return SentOrder(next(self._numbers), spec, tube, arguments, by, self._string.time.rig_now, utc)

    def _keep(self, order: SentOrder, *, wake: bool = True) -> None:
        self._orders.add(order)
        self.publish_orders()
        if wake:
            self.wake()

    def _start_upload(self, order: SentOrder, block: ParameterBlock) -> None:
        """Keep a block, so that what the tube uses later can be named, and have it sent."""
        if self._model.recalibration.uploads_to(block.tube):
            raise SelectorError(f"tube {block.tube}: a calibration uploads to it; expected action=cancel before")
        self._store.keep_block(block)
        self._model.recalibration.blocks[block.sha256().hex()] = block
        self._pending.append(BlockUpload(order.number, block))

    def _surveyed_biases(self) -> SurveyedBiases:
        states, mixed = self._string.states.newest, self._recalibration.procedure.progress.mixed
        return surveyed_biases(self._config, self._model.hole, states, mixed)

    def _cancel_upload(self, tube: int) -> None:
        if self._uploads is not None:
            self._orders.fail(self._uploads.cancel(tube), "cancelled")

    def _check_key(self) -> None:
        if self._uploads is None:
            raise ConfigurationError(NO_KEY)

    def _waiting(self) -> list[SentOrder]:
        return [order for order in self._orders if not order.answered and order.by != RECALIBRATION]

    def _check_room(self, tube: int) -> None:
        waiting = sum(order.tube == tube for order in self._waiting())
        if waiting >= OPEN_AT_MOST:
            raise SelectorError(f"tube {tube}: expected at most {OPEN_AT_MOST} orders without an answer, got {waiting}")

    def _check_tube(self, tube: int) -> None:
        hanging = self._string.tubes
        known = hanging + [tube for tube in sorted(self._string.states.newest) if tube not in hanging]
        if tube not in known:
            expected = f"expected one of {', '.join(map(str, known))}" if known else "no tube has reported yet"
            raise SelectorError(f"tube {tube}: not in the string; {expected}")


def check_name(by: str) -> None:
    """Refuse a name that no screen could show.

    Raises
    ------
    SelectorError
        When it is empty, too long or not printable.
    """
    if not by.isprintable() or not 1 <= len(by.strip()) <= LONGEST_NAME:
        raise SelectorError(f"by: expected a name of 1 to {LONGEST_NAME} printable characters, got {by!r:.40}")


def _request_arguments(request: Request) -> dict[str, Any]:
    return dict(request.arguments) if request.block is None else {"version": request.block.version}

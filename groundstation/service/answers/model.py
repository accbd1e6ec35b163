"""The parts of what a ground station knows of its rig, side by side, which views are given together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from groundstation.config import GroundConfig
from groundstation.service.alarms.crew_alarms import CrewAlarms
from groundstation.service.alarms.rig_alarms import RigAlarms
from groundstation.service.answers.kept_texts import KeptTexts
from groundstation.service.answers.revisions import Revisions
from groundstation.service.hole.live_wall import LiveWall
from groundstation.service.hole.placement import Placement
from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.service.orders.order_book import OrderBook
from groundstation.service.orders.recalibration.procedure import FieldProcedure
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.string.known_string import KnownString
from groundstation.survey.fusion.shared import SharedErrors


@dataclass(frozen=True, slots=True)
class RigModel:
    """What is known: each part has its own state and its own verbs.

    ``texts`` and ``revisions`` are of the answers, ``wall`` is None without a wall file.
    """

    config: GroundConfig
    string: KnownString
    setup: SetupBook
    hole: SurveyedHole
    placement: Placement
    rig_alarms: RigAlarms
    crew_alarms: CrewAlarms
    orders: OrderBook
    recalibration: FieldProcedure
    wall: LiveWall | None
    texts: KeptTexts
    revisions: Revisions

    @classmethod
    def begin(cls, config: GroundConfig) -> Self:
        """All parts of a ground station that knows nothing yet.

        Raises
        ------
        SurveyError
            When the wall of its configuration cannot be read.
        """
        string, shared = KnownString(config), SharedErrors()
        setup = SetupBook(config)
        string.doubled = setup.doubled
        hole = SurveyedHole(config, shared, setup)
        return cls(
            config=config,
            string=string,
            setup=setup,
            hole=hole,
            placement=Placement(config, string, hole, shared, setup),
            rig_alarms=RigAlarms(),
            crew_alarms=CrewAlarms(),
            orders=OrderBook(),
            recalibration=FieldProcedure(config.gravity),
            wall=None if config.wall is None else LiveWall(config.wall, config.hole),
            texts=KeptTexts(hole),
            revisions=Revisions(),
        )

    def newest_row(self, stream: str) -> int:
        """Number of the newest row of a stream that is shown: measurements, events or static records."""
        match stream:
            case "measurements":
                return self.hole.newest
            case "events":
                return self.string.events.newest
            case _:
                return self.string.static_records.newest

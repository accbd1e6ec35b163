"""What every table of a scenario file is made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Probability = Annotated[float, Field(ge=0.0, le=0.9)]
Angle = Annotated[float, Field(ge=-180.0, le=180.0)]
Triple = tuple[NotNegative, NotNegative, NotNegative]


class ScenarioSection(BaseModel):
    """Base of every table: frozen, unknown keys, infinities and NaN refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

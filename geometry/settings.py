"""The base of all settings: frozen, keyword-only, checked, and clear about what is wrong with them."""

from __future__ import annotations

from math import pi
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from geometry.errors import ConfigError

Positive = Annotated[float, Field(gt=0.0, le=1e12)]
NonNegative = Annotated[float, Field(ge=0.0, le=1e12)]
Short = Annotated[float, Field(ge=0.0, le=100.0)]
"""A length of which a cycle looks at every few centimetres [m]."""
Tolerance = tuple[Positive, Positive, Annotated[float, Field(gt=0.0, le=pi)]]
Triple = tuple[NonNegative, NonNegative, NonNegative]


class Settings(BaseModel):
    """A frozen group of settings; a bad value raises `ConfigError` with field, value and what is allowed."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise ConfigError(_explain(type(self).__name__, error)) from None


def _explain(name: str, error: ValidationError) -> str:
    problems = []
    for item in error.errors():
        field = ".".join([name, *(str(part) for part in item["loc"])])
        if item["type"] == "extra_forbidden":
            problems.append(f"{field} is not a setting")
        else:
            shown = "" if isinstance(item["input"], dict) else f" = {item['input']!r}"
            problems.append(f"{field}{shown}: {item['msg']}")
    return "; ".join(problems)

"""The base of all settings: frozen, keyword-only, checked, and clear about what is wrong with them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from inspect import getdoc
from math import pi
from types import NoneType
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator
from pydantic_core import ErrorDetails

from geometry.errors import ConfigError

Positive = Annotated[float, Field(gt=0.0, le=1e12)]
NonNegative = Annotated[float, Field(ge=0.0, le=1e12)]
Short = Annotated[float, Field(ge=0.0, le=100.0)]
"""A length of which a cycle looks at every few centimetres [m]."""
Tolerance = tuple[Positive, Positive, Annotated[float, Field(gt=0.0, le=pi)]]
Triple = tuple[NonNegative, NonNegative, NonNegative]
Group = TypeVar("Group", bound="Settings")
CONSTANT = "a constant"
"""Of a former setting that nobody has a reason to set, see `Settings.former`."""

_ENTRY = re.compile(r"\n    (?=\S)|;\s+(?=(?:\w+,\s+)*\w+: )")
_UNIT = re.compile(r"\[([^\]]+)\]")


class Settings(BaseModel):
    """A frozen group of settings; a bad value raises `ConfigError` with field, value, unit and range.

    `former` says of former settings, blanks between them, what they are now: a new name, or `CONSTANT`.
    """

    former: ClassVar[Mapping[str, str]] = {}
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**_spelt_out(type(self), values))
        except ValidationError as error:
            problems = (_problem(type(self), item) for item in error.errors())
            raise ConfigError("; ".join(problems)) from None

    def changed(self, **changes: Any) -> Self:
        """Return a checked copy with some settings changed. A dict changes some settings of a group:

            config.changed(cycle=0.02, limits={"speed": 1.5}, comfort={"jerk": 2.0})

        Raises:
            ConfigError: an unknown setting, or a value that is not allowed.
        """
        values = {name: getattr(self, name) for name in self.model_fields_set}
        for name, value in _spelt_out(type(self), changes).items():
            group = getattr(self, name, None)
            if isinstance(group, Settings) and isinstance(value, Mapping):
                value = group.changed(**{str(key): each for key, each in value.items()})
            values[name] = value
        return type(self)(**values)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy; with an `update` it is `changed`, and checked."""
        copy = super().model_copy(deep=deep)
        return copy.changed(**update) if update else copy

    @field_validator("*", mode="before")
    @classmethod
    def _plain(cls, value: Any, info: ValidationInfo) -> Any:
        """Turn numpy's values into Python's; refuse text and truth values in the place of numbers."""
        if isinstance(value, np.generic | np.ndarray):
            value = value.tolist()
        if any(isinstance(each, str | bool) for each in _flat(value)):
            kinds = set(_leaves(cls.model_fields[info.field_name or ""].annotation))
            if kinds <= {float, int, NoneType}:
                wanted = "a number" if float in kinds else "an integer"
                raise ValueError(f"must be {wanted}, not text or a truth value")
        return value


def replaced(settings: Group, **changes: Any) -> Group:
    """Return an unchecked copy with values that the program itself has made."""
    return BaseModel.model_copy(settings, update=changes)


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """What to add to a message about an unknown name: "", or "; did you mean 'wheelbase'?"."""
    close = get_close_matches(name, list(names), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Return the models that an annotation names, also inside of a tuple or of alternatives."""
    return (each for each in _leaves(annotation) if isinstance(each, type) and issubclass(each, BaseModel))


def _leaves(annotation: Any) -> Iterator[Any]:
    inner = [each for each in get_args(annotation) if isinstance(each, type) or get_args(each)]
    if not inner:
        yield annotation
    for each in inner:
        yield from _leaves(each)


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, list | tuple):
        for each in value:
            yield from _flat(each)
    else:
        yield value


def _spelt_out(cls: type[BaseModel], values: Mapping[str, Any]) -> dict[str, Any]:
    """Values with comfort={"jerk": 2.0} as comfort_jerk=2.0, where there are fields of such names."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        long = {f"{name}_{key}": each for key, each in value.items()} if isinstance(value, Mapping) else {}
        known = name not in cls.model_fields and bool(long) and long.keys() <= cls.model_fields.keys()
        found |= long if known else {name: value}
    return found


def _problem(cls: type[BaseModel], item: ErrorDetails) -> str:
    field = ".".join([cls.__name__, *(str(part) for part in item["loc"])])
    owner, names = _owner(cls, item["loc"])
    if item["type"] == "extra_forbidden":
        name = str(item["loc"][-1])
        table = owner.former.items() if issubclass(owner, Settings) else ()
        if former := next((now for old, now in table if name in old.split()), ""):
            return f"{field} is not a setting any more, but {former}"
        groups = [group for group, inner in _groups(cls) if name in inner.model_fields]
        meant = f"; did you mean '{groups[0]}.{name}'?" if groups else did_you_mean(name, owner.model_fields)
        return f"{field} is not a setting{meant}"
    unit = _unit(owner, str(names[0]), names[1] if len(names) > 1 else None) if names else ""
    shown = "" if isinstance(item["input"], dict) else f" = {item['input']!r}"
    said = item["msg"].removeprefix("Value error, ")
    return f"{field}{shown}: {said}{f' [{unit}]' if unit and shown else ''}"


def _owner(cls: type[BaseModel], location: Iterable[int | str]) -> tuple[type[BaseModel], list[int | str]]:
    """The group that a location is in, and the rest of the location there: a field, perhaps a place in it."""
    rest: list[int | str] = []
    for part in location:
        inner = _group(cls, str(rest[0])) if rest else None
        if inner is not None:
            cls, rest = inner, []
        rest.append(part)
    return cls, rest


def _group(cls: type[BaseModel], name: str) -> type[BaseModel] | None:
    field = cls.model_fields.get(name)
    return None if field is None else next(models_in(field.annotation), None)


def _groups(cls: type[BaseModel], above: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    for name in cls.model_fields:
        inner = _group(cls, name)
        if inner is not None:
            yield f"{above}{name}", inner
            yield from _groups(inner, f"{above}{name}.")


def _unit(cls: type[BaseModel], name: str, place: int | str | None) -> str:
    """The unit of a setting as its class's docstring says it, or ""; `place`: of a value with several."""
    for entry in _ENTRY.split((getdoc(cls) or "").partition("Attributes:\n")[2]):
        listed, _colon, text = entry.strip().partition(": ")
        names, units = re.split(r",\s+", listed), _UNIT.findall(text)
        if name not in names or not units:
            continue
        if len(names) > 1 and len(units) > 1:
            return str(units[names.index(name)]) if len(units) == len(names) else ""
        if isinstance(place, int):
            return str(units[min(place, len(units) - 1)])
        several = "tuple" in str(cls.model_fields[name].annotation)
        return ", ".join(units) if several else str(units[0])
    beside = re.search(rf"\b{name} \[([^\]]+)\]", getdoc(cls) or "")
    return beside.group(1) if beside else ""

"""What is wrong with a TOML file that does not fit its models: one line a problem, in plain words."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from rti_mpcc.errors import ScenarioError

Model = TypeVar("Model", bound=BaseModel)


class Problem(NamedTuple):
    """One thing wrong: the dotted key, its value as shown to the user or None, and what is allowed."""

    key: str
    value: object
    allowed: str

    def __str__(self) -> str:
        if self.value is None:
            return f"{self.key}: {self.allowed}"
        return f"{self.key} = {_shown(self.value)}: {self.allowed}"


def read_text(file: Path) -> str:
    """The text of a file. Raises ScenarioError."""
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise ScenarioError(f"{file}: cannot be read, {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{file}: is not UTF-8 text, byte {error.start} is wrong") from error


def parsed(text: str, source: str) -> dict[str, Any]:
    """What a TOML text says. Raises ScenarioError."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: is not TOML, {error}") from error


def validated(model: type[Model], data: Mapping[str, Any], *, source: str, folder: Path | None) -> Model:
    """The model of what a file says. Raises ScenarioError, with a line for each problem of a single value."""
    try:
        return model.model_validate(dict(data), context={"folder": folder})
    except ValidationError as error:
        raise ScenarioError("\n".join(f"{source}: {line}" for line in _lines(error, model))) from error


def _shown(value: object) -> str:
    text = value if isinstance(value, str) and " " in value else repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _lines(error: ValidationError, model: type[BaseModel]) -> list[str]:
    """One line a problem. A list whose entries are wrong is also told to be too short: that is dropped."""
    items = error.errors()
    inner = {item["loc"][:depth] for item in items for depth in range(len(item["loc"]))}
    return [
        _worded(item, model) for item in items if not (item["type"] == "too_short" and item["loc"] in inner)
    ]


def _worded(error: ErrorDetails, model: type[BaseModel]) -> str:
    """One of pydantic's errors in this project's words."""
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in error["loc"]).lstrip(".")
    kind, context = error["type"], error.get("ctx", {})
    if kind == "missing":
        return str(Problem(key, None, "required"))
    if kind == "extra_forbidden":
        allowed = f"unknown key, allowed are {', '.join(_keys(error['loc'][:-1], model))}"
        return str(Problem(key, error["input"], allowed))
    if kind == "value_error":
        return str(Problem(key, error["input"], str(context["error"])))
    allowed = _allowed(kind, context) or error["msg"][0].lower() + error["msg"][1:]
    return str(Problem(key, error["input"], allowed))


def _allowed(kind: str, context: Mapping[str, Any]) -> str | None:
    """What pydantic's kind of error allows; None where its own message serves."""
    comparison = {
        "greater_than": ("gt", ">"),
        "greater_than_equal": ("ge", ">="),
        "less_than": ("lt", "<"),
        "less_than_equal": ("le", "<="),
    }
    if kind in comparison:
        name, sign = comparison[kind]
        return f"must be {sign} {context[name]:g}"
    words = {
        "float_type": "must be a number",
        "int_type": "must be an integer",
        "string_type": "must be text",
        "bool_type": "must be true or false",
        "tuple_type": "must be a list",
        "model_type": "must be a table",
        "model_attributes_type": "must be a table",
        "finite_number": "must be a finite number",
        "string_pattern_mismatch": "must be letters, digits, dots, dashes and underscores",
    }
    if kind in ("too_long", "too_short"):
        sign, limit = ("<=", "max_length") if kind == "too_long" else (">=", "min_length")
        return f"number of entries must be {sign} {context[limit]}, not {context['actual_length']}"
    return f"must be {context['expected']}" if kind == "literal_error" else words.get(kind)


def _keys(location: tuple[int | str, ...], model: type[BaseModel]) -> list[str]:
    """The keys that the table at `location` in a model knows."""
    for part in location:
        if isinstance(part, str):
            field = next(f for n, f in model.model_fields.items() if part in (n, f.alias))
            model = _model_in(field.annotation)
    return [field.alias or name for name, field in model.model_fields.items()]


def _model_in(annotation: Any) -> type[BaseModel]:
    """The model inside of `tuple[Model, ...] | None` and the like."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    inner = getattr(annotation, "__args__", ())
    return next(_model_in(item) for item in inner if item not in (type(None), Ellipsis))

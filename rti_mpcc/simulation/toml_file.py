"""What is wrong with a TOML file that does not fit its models: one line a problem, in plain words."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from geometry import files
from geometry.errors import shown
from geometry.settings import did_you_mean
from rti_mpcc.errors import ConfigError, ScenarioError

Model = TypeVar("Model", bound=BaseModel)
Location = tuple[int | str, ...]
"""Of a value: keys of tables and places in lists, from the top of the file."""
_KEY = 120  # characters of a key that are shown


class Problem(NamedTuple):
    """One thing wrong: the dotted key, its value as shown to the user or None, and what is allowed."""

    key: str
    value: object
    allowed: str

    def __str__(self) -> str:
        key = self.key if self.key.isprintable() and len(self.key) <= _KEY else shown(self.key, _KEY)
        if self.value is None:
            return f"{key}: {self.allowed}"
        return f"{key} = {shown(self.value)}: {self.allowed}"


def read_text(file: Path) -> str:
    """The text of a file. Raises ScenarioError."""
    try:
        return files.text(file)
    except OSError as error:
        raise ScenarioError(f"{file}: cannot be read, {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{file}: is not UTF-8 text, byte {error.start} is wrong") from error


def parsed(text: str, source: str) -> dict[str, Any]:
    """What a TOML text says. Raises ScenarioError."""
    try:
        return files.from_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: is not TOML, {error}") from error
    except ValueError as error:
        raise ScenarioError(f"{source}: is not TOML that is read here, it {error}") from error


def validated(model: type[Model], data: Mapping[str, Any], *, source: str, folder: Path | None) -> Model:
    """The model of what a file says. Raises ScenarioError, with a line for each problem of a single value."""
    try:
        return model.model_validate(dict(data), context={"folder": folder})
    except ValidationError as error:
        raise ScenarioError(told(problems_in(error, model), source)) from error


def told(problems: Sequence[Problem], source: str) -> str:
    """One line a problem, with the file in front."""
    return "\n".join(f"{source}: {problem}" for problem in problems)


def settings_problems(error: ConfigError, key: str, model: type[BaseModel]) -> list[Problem]:
    """What is wrong with settings that are made of the table `key` of a file with this model."""
    inner = _of_settings(error)
    return [Problem(key, None, str(error))] if inner is None else problems_in(inner, model, (key,))


def problems_in(error: ValidationError, model: type[BaseModel], at: Location = ()) -> list[Problem]:
    """What is wrong with the table at `at` of a file with this model, in this project's words.

    A list whose entries are wrong is also told to be too short: that is dropped.
    """
    items = error.errors()
    inner = {item["loc"][:depth] for item in items for depth in range(len(item["loc"]))}
    found: list[Problem] = []
    for item in items:
        if item["type"] == "too_short" and item["loc"] in inner:
            continue
        location = (*at, *item["loc"])
        settings = _of_settings(item.get("ctx", {}).get("error"))
        if settings is not None:
            found += problems_in(settings, model, location)
        else:
            found.append(_worded(item, location, model))
    return found


def _of_settings(error: object) -> ValidationError | None:
    """What a `ConfigError` of settings was raised for: it names their class, which a file does not know."""
    cause = error.__context__ if isinstance(error, ConfigError) else None
    return cause if isinstance(cause, ValidationError) else None


def _worded(error: ErrorDetails, location: Location, model: type[BaseModel]) -> Problem:
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")
    kind, context = error["type"], error.get("ctx", {})
    if kind == "missing":
        return Problem(key, None, "required")
    if kind == "extra_forbidden":
        keys = _keys(location[:-1], model)
        return Problem(
            key,
            error["input"],
            f"unknown key, allowed are {', '.join(keys)}{did_you_mean(str(location[-1]), keys)}",
        )
    if kind == "value_error":
        return Problem(key, error["input"], str(context["error"]))
    return Problem(key, error["input"], _allowed(kind, context) or error["msg"][0].lower() + error["msg"][1:])


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
        "float_parsing": "must be a number",
        "int_type": "must be an integer",
        "int_parsing": "must be an integer",
        "int_from_float": "must be an integer",
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


def _keys(location: Location, model: type[BaseModel]) -> list[str]:
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

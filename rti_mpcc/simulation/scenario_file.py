"""From a scenario file, or the name of a built-in one, to a Scenario, with one line a problem."""

from __future__ import annotations

import logging
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from rti_mpcc.errors import ScenarioError
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.scenario_checks import problems, remarks

_LOG = logging.getLogger(__name__)
_BUILT_IN = files("rti_mpcc.simulation") / "scenarios"


def builtin_names() -> tuple[str, ...]:
    """Names of the scenarios that come with the package, sorted."""
    names = (Path(entry.name) for entry in _BUILT_IN.iterdir())
    return tuple(sorted(name.stem for name in names if name.suffix == ".toml"))


def load_scenario(name_or_file: str | Path) -> Scenario:
    """A built-in scenario by name, or a .toml file.

    Logs a warning for what is allowed but will show. Raises ScenarioError with one line a problem:
    `file: key = value: what is allowed`.
    """
    name = str(name_or_file)
    if name in builtin_names():
        text = (_BUILT_IN / f"{name}.toml").read_text(encoding="utf-8")
        return _parse(text, source=f"{name}.toml", folder=Path(str(_BUILT_IN)))
    file = Path(name_or_file)
    if file.suffix != ".toml":
        raise ScenarioError(f"{name}: must be a .toml file or one of {', '.join(builtin_names())}")
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise ScenarioError(f"{name}: cannot be read, {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{name}: is not UTF-8 text, byte {error.start} is wrong") from error
    return _parse(text, source=name, folder=file.parent)


def scenario_from_dict(
    data: Mapping[str, Any], *, source: str = "scenario", folder: Path | None = None
) -> Scenario:
    """A scenario from the tables of a file as dicts and lists.

    `source` stands in front of error messages; a relative path.file or area.map is taken from `folder`
    (default: the working directory). Raises ScenarioError as `load_scenario`.
    """
    try:
        scenario = Scenario.model_validate(dict(data), context={"folder": folder})
    except ValidationError as error:
        raise ScenarioError("\n".join(f"{source}: {line}" for line in _lines(error))) from error
    found = problems(scenario)
    if found:
        raise ScenarioError("\n".join(f"{source}: {_line(p.key, p.value, p.allowed)}" for p in found))
    for remark in remarks(scenario):
        _LOG.warning("%s: %s", source, remark)
    return scenario


def changed(scenario: Scenario, changes: Mapping[str, Any]) -> Scenario:
    """The scenario with other values, checked anew: changed(s, {"goal.offset": [1, 3, 0]}).

    A key is dotted as in the file (lists are replaced whole); the value None takes the key out.
    """
    data = scenario.model_dump(by_alias=True, exclude_unset=True)
    for key, value in changes.items():
        *tables, last = key.split(".")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        if value is None:
            table.pop(last, None)
        else:
            table[last] = value
    return scenario_from_dict(data, source=scenario.name)


def _parse(text: str, *, source: str, folder: Path) -> Scenario:
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: is not TOML, {error}") from error
    return scenario_from_dict(data, source=source, folder=folder)


def _line(key: str, value: object, allowed: str) -> str:
    return f"{key}: {allowed}" if value is None else f"{key} = {_shown(value)}: {allowed}"


def _shown(value: object) -> str:
    text = value if isinstance(value, str) and " " in value else repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _lines(error: ValidationError) -> list[str]:
    """One line a problem. A list whose entries are wrong is also told to be too short: that is dropped."""
    items = error.errors()
    inner = {item["loc"][:depth] for item in items for depth in range(len(item["loc"]))}
    return [_worded(item) for item in items if not (item["type"] == "too_short" and item["loc"] in inner)]


def _worded(error: ErrorDetails) -> str:
    """One of pydantic's errors in this project's words."""
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in error["loc"]).lstrip(".")
    kind, context = error["type"], error.get("ctx", {})
    if kind == "missing":
        return _line(key, None, "required")
    if kind == "extra_forbidden":
        return _line(key, error["input"], f"unknown key, allowed are {', '.join(_keys(error['loc'][:-1]))}")
    return _line(key, error["input"], _allowed(kind, context) or error["msg"][0].lower() + error["msg"][1:])


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


def _keys(location: tuple[int | str, ...]) -> list[str]:
    """The keys that the table at `location` knows."""
    model: type[BaseModel] = Scenario
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

"""What all tables of a TOML file share: their checks, the types of their values, and one line a problem."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo, model_validator
from pydantic_core import ErrorDetails, ValidationError

from geometry import files
from geometry.errors import shown
from geometry.settings import did_you_mean, models_in
from rti_mpcc.config import Vehicle
from rti_mpcc.errors import ConfigError, InputError, ScenarioError

Model = TypeVar("Model", bound=BaseModel)
Item = TypeVar("Item")
Location = tuple[int | str, ...]  # of a value: keys of tables and places in lists, from the top of the file

# TOML has lists only; strictness stays on for what is in them.
ListOf = Annotated[tuple[Item, ...], Field(strict=False)]
Pair = Annotated[tuple[float, float], Field(strict=False)]
Triple = Annotated[tuple[float, float, float], Field(strict=False)]
Polygon = Annotated[tuple[Pair, ...], Field(strict=False, min_length=3)]
Outline = Annotated[tuple[Pair, ...], Field(strict=False, min_length=1)]  # a polygon, a line, or a point
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Tolerance = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]


class KeyProblem(NamedTuple):
    """One thing wrong: the dotted key, its value as shown to the user or None, and what is allowed."""

    key: str
    value: object
    allowed: str

    def __str__(self) -> str:
        longest = 120  # characters of a key that are shown
        fits = self.key.isprintable() and len(self.key) <= longest
        key = self.key if fits else shown(self.key, longest)
        value = "" if self.value is None else f" = {shown(self.value)}"
        return f"{key}{value}: {self.allowed}"


class WrongTable(ValueError):
    """Values of a table that do not go together; keys of the problems are relative to the table."""

    def __init__(self, problems: list[KeyProblem]) -> None:
        super().__init__("; ".join(map(str, problems)))
        self.problems = problems


class Section(BaseModel):
    """A table of a file: immutable, exact types (an int may be a float), no unknown keys, no NaN or inf."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="after")
    def _go_together(self) -> Self:
        if found := list(self._problems()):
            raise WrongTable(found)
        return self

    def _problems(self) -> Iterator[KeyProblem]:
        """Values that are allowed each by itself, but not together."""
        yield from ()


def _not_huge(vehicle: Vehicle) -> Vehicle:
    lengths = vehicle.model_dump(include={"wheelbase", "width", "front", "rear"}, exclude_unset=True)
    if huge := [KeyProblem(key, size, "must be <= 100") for key, size in lengths.items() if size > 100.0]:
        raise WrongTable(huge)
    return vehicle


VehicleTable = Annotated[Vehicle, AfterValidator(_not_huge)]


def _beside_the_file(file: str, info: ValidationInfo) -> str:
    folder = (info.context or {}).get("folder")
    return file if folder is None else str(Path(folder) / file)


FileName = Annotated[str, AfterValidator(_beside_the_file)]
"""A relative file lies relative to the one that names it."""
_NAMED = re.compile(
    r"(?:[A-Z]\w*\.)?(?P<key>[a-z]\w*(?:\[\d+\]|\.[a-z]\w*)*)(?: = (?P<value>.+?))?"
    r"(?::|(?= (?:is|has|does) )) (?P<allowed>.+)"
)
"""How errors of the packages name what is wrong: of a class or not, with its value or not."""


class _Given(str):
    """A value as an error has it already."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def refusal(
    key: str, value: object, build: Callable[[], object], table: type[BaseModel] | None = None
) -> list[KeyProblem]:
    """That what is built of a value raises InputError; one that names a key of `table` is put under it."""
    try:
        build()
    except InputError as error:
        return [key_problem(error, key, value, table)]
    return []


def key_problem(
    error: InputError, key: str, value: object = None, table: type[BaseModel] | None = None
) -> KeyProblem:
    """What an error says of a value; of a key of `table` that it names, if there is one."""
    said = str(error).removesuffix(".")
    named = None if table is None else _NAMED.fullmatch(said)
    if table is None or named is None or re.split(r"\W", named["key"])[0] not in table.model_fields:
        return KeyProblem(key, value, said)
    inside, allowed = (_with_aliases(named[part], table) for part in ("key", "allowed"))
    given = named["value"]
    known = None if given in (None, "None") else _Given(given)
    return KeyProblem(f"{key}.{inside}" if key else inside, known, allowed)


def _with_aliases(text: str, table: type[BaseModel]) -> str:
    """A text with the names of fields as files have them, of all tables in this one."""
    for field in table.model_fields.values():
        for inner in models_in(field.annotation):
            for name, each in inner.model_fields.items():
                if each.alias:
                    text = re.sub(rf"\b{name}(?= =|$)", each.alias, text)
    return text


def read_toml(model: type[Model], file: Path, source: str) -> Model:
    """The model of a TOML file. Raises ScenarioError with one line a problem, `source` in front."""
    try:
        data = files.from_toml(files.text(file))
    except OSError as error:
        raise ScenarioError(f"{source}: cannot be read, {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{source}: is not UTF-8 text, byte {error.start} is wrong") from error
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: is not TOML, {error}") from error
    except ValueError as error:
        raise ScenarioError(f"{source}: is not TOML that is read here, it {error}") from error
    return parsed(model, data, source=source, folder=file.parent)


def parsed(model: type[Model], data: Mapping[str, Any], *, source: str, folder: Path | None) -> Model:
    """The model of the tables of a file, in which relative files lie in `folder`. Raises as `read_toml`."""
    try:
        return model.model_validate(dict(data), context={"folder": folder})
    except ValidationError as error:
        lines = (f"{source}: {problem}" for problem in translated(error, model))
        raise ScenarioError("\n".join(lines)) from error


def translated(error: ValidationError, model: type[BaseModel], at: Location = ()) -> list[KeyProblem]:
    """Pydantic's errors in the table at `at` of a file with this model, in this project's words.

    A list whose entries are wrong is also said to be too short: that is dropped.
    """
    items = error.errors()
    inner = {item["loc"][:depth] for item in items for depth in range(len(item["loc"]))}
    found: list[KeyProblem] = []
    for item in items:
        if item["type"] == "too_short" and item["loc"] in inner:
            continue
        location = (*at, *item["loc"])
        cause = item.get("ctx", {}).get("error")
        if isinstance(cause, WrongTable):
            key, _ = _resolved(location, model)
            for problem in cause.problems:
                dot = "" if problem.key[:1] in ("", "[") or not key else "."
                found.append(problem._replace(key=key + dot + problem.key))
        elif isinstance(cause, ConfigError) and isinstance(cause.__context__, ValidationError):
            # It names the class of the settings, which a file does not know.
            found += translated(cause.__context__, model, location)
        else:
            found.append(_worded(item, location, model))
    return found


def _worded(error: ErrorDetails, location: Location, model: type[BaseModel]) -> KeyProblem:
    key, table = _resolved(location, model)
    kind, context, value = error["type"], error.get("ctx", {}), error["input"]
    if kind == "missing":
        return KeyProblem(key, None, f"required{_for_kind(table)}")
    if kind == "extra_forbidden":
        keys = [field.alias or name for name, field in table.model_fields.items()]
        meant = did_you_mean(str(location[-1]), keys)
        return KeyProblem(key, value, f"unknown key{_for_kind(table)}, allowed are {', '.join(keys)}{meant}")
    if kind == "value_error":
        return KeyProblem(key, value, str(context["error"]))
    words = _ALLOWED.get(kind) or _ALLOWED.get(kind.partition("_")[0])
    allowed = words.format(**context) if words else error["msg"][0].lower() + error["msg"][1:]
    return KeyProblem(key, value, allowed)


_ALLOWED = {
    "greater_than": "must be > {gt:g}",
    "greater_than_equal": "must be >= {ge:g}",
    "less_than": "must be < {lt:g}",
    "less_than_equal": "must be <= {le:g}",
    "too_long": "number of entries must be <= {max_length}, not {actual_length}",
    "too_short": "number of entries must be >= {min_length}, not {actual_length}",
    "literal_error": "must be {expected}",
    "float": "must be a number",
    "int": "must be an integer",
    "string_type": "must be text",
    "string_pattern_mismatch": "must be letters, digits, dots, dashes and underscores",
    "bool": "must be true or false",
    "tuple": "must be a list",
    "model": "must be a table",
    "finite_number": "must be a finite number",
}
"""Allowed values by pydantic's kind of error, or by its first word; its own message serves for others."""


def _for_kind(table: type[BaseModel]) -> str:
    """For which kind of a table, where each kind has its own keys."""
    kinds = get_args(table.model_fields["kind"].annotation) if "kind" in table.model_fields else ()
    return f" for kind = {kinds[0]!r}" if len(kinds) == 1 else ""


def _resolved(location: Location, model: type[BaseModel]) -> tuple[str, type[BaseModel]]:
    """The key of a location in a file, and the table that its last part is in."""
    key, inside = "", [model]
    for place, part in enumerate(location):
        if isinstance(part, int):
            key += f"[{part}]"
            continue
        key += f".{part}" if key else part
        fields = (field for name, field in inside[0].model_fields.items() if part in (name, field.alias))
        if place < len(location) - 1 and (field := next(fields, None)) is not None:
            inside = list(models_in(field.annotation)) or inside
    return key, inside[0]

"""[[mission]]: a table for each step, with a key for each field that a file can hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from functools import cache
from types import NoneType
from typing import Annotated, Any, ClassVar, Literal, get_args, get_type_hints

from numpy.typing import ArrayLike
from pydantic import BeforeValidator, Field, SerializeAsAny, ValidationError, create_model

from geometry import Pose2
from rti_mpcc.mission import Approach, Step
from rti_mpcc.mission.step import COMMON, STEPS, Signal, Then
from rti_mpcc.simulation.sections.base import KeyProblem, Pair, Section, Triple, WrongTable, translated


class ObjectSection(Section):
    """A table with keys for fields of the class `makes`."""

    makes: ClassVar[Callable[..., Any]]

    def given(self) -> dict[str, Any]:
        """The fields that are given. Raises InputError."""
        values = {name: getattr(self, name) for name in self.model_fields_set}
        tables = {name: each.build() for name, each in values.items() if isinstance(each, ObjectSection)}
        return values | tables

    def build(self) -> Any:
        """The object. Raises InputError."""
        return type(self).makes(**self.given())


class ApproachSection(ObjectSection):
    """The straight last piece of the route into the dock: length [m], direction 1 (forward) or -1."""

    makes = Approach
    length: Annotated[float, Field(gt=0.0, le=100.0)]
    direction: Literal[1, -1]


class StepSection(ObjectSection):
    """The keys that all steps have, see `rti_mpcc.mission.Step`; what is not given is as in Python."""

    timeout: float | None = None
    patience: float | None = None
    retries: int | None = None
    retry_from: int | None = None
    then: Then | None = None
    kind: str

    def build(self, goal: Pose2 | None = None, body: ArrayLike | None = None) -> Step:
        """The step. Raises InputError.

        `goal`: of a dock with a planned route, else None; `body`: outline (k, 2) of the docked object in its
        frame [m].
        """
        step = STEPS[self.kind]
        hints, given = get_type_hints(step), self.given()
        del given["kind"]
        if given.pop(CONTACT, False):
            given["until"] = signalled_by_the_simulation
        given |= {name: Pose2(*given[name]) for name in given if Pose2 in _kinds(hints[name])}
        if step.at_goal:
            given.update(pose=goal, body=body)
        return step(**given)


CONTACT = "contact"
"""Key of a step that a signal ends, its field `until`: the vehicle touches what it docks at."""
IN_FILES: dict[Any, Any] = {
    **{kind: kind for kind in (float, int, bool, str)},
    Pose2: Triple,
    Approach: ApproachSection,
    tuple[float, float]: Pair,
    tuple[float, float, float]: Triple,
}
"""How files hold the values of a field, by its type."""


@cache
def table_of(kind: str) -> type[StepSection]:
    """The model of the tables of a kind of step."""
    step = STEPS[kind]
    keys: dict[str, Any] = {"kind": (Literal[step.word], ...)}
    hints = get_type_hints(step)
    for each in fields(step):
        kinds = _kinds(hints[each.name])
        if each.name in COMMON or (step.keys is not None and each.name not in step.keys):
            continue
        if kinds == (Signal,):
            keys[CONTACT] = (bool | None, None)
        elif len(kinds) == 1 and kinds[0] in IN_FILES:
            held, needed = IN_FILES[kinds[0]], each.default is MISSING and each.default_factory is MISSING
            keys[each.name] = (held, ...) if needed else (held | None, None)
    return create_model(f"{step.__name__}Table", __base__=StepSection, **keys)


def _kinds(hint: Any) -> tuple[Any, ...]:
    """The types of a field, but None."""
    if hint == Signal or hint in IN_FILES:
        return (hint,)
    return tuple(each for each in get_args(hint) if each is not NoneType)


def _table(given: Any) -> Any:
    """The table of its kind."""
    if isinstance(given, StepSection) or not isinstance(given, Mapping):
        return given
    if "kind" not in given:
        raise WrongTable([KeyProblem("kind", None, "required")])
    if given["kind"] not in STEPS:
        *words, last = map(repr, sorted(STEPS))
        raise WrongTable([KeyProblem("kind", given["kind"], f"must be {', '.join(words)} or {last}")])
    try:
        return table_of(given["kind"]).model_validate(given)
    except ValidationError as error:
        raise WrongTable(translated(error, table_of(given["kind"]))) from None


MissionSection = Annotated[SerializeAsAny[StepSection], BeforeValidator(_table)]


def signalled_by_the_simulation() -> bool:
    """Stands for a contact switch: the closed loop gives the signal to `DockingMission.step` itself."""
    return False

"""Doors: arguments of public functions, turned into what the inside wants, or refused in one sentence.

The annotations of a function say what it takes. `door` turns numbers of all kinds (whole ones, numpy's,
float32) into floats, and anything that holds numbers into a contiguous array of floats. Any other argument
raises with its name, its value and what is allowed.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from functools import cache, partial, wraps
from inspect import Parameter, signature
from math import inf
from numbers import Integral, Real
from os import PathLike
from typing import Any, Final, Literal, ParamSpec, TypeVar, get_args, get_origin

import numpy as np
import numpy.typing

from geometry.arrays import Array, is_array
from geometry.errors import BAD_INPUT, InputError, shown

Given = ParamSpec("Given")
Result = TypeVar("Result")
Turn = Callable[[Any], Any]
"""Turns a value into what is wanted; raises `_Unfit` where it cannot."""

_PENDING: list[Callable[..., Any]] = []
"""Doors whose annotations nobody has read yet."""


class Validated:
    """Base of dataclasses whose fields are turned into what their annotations say.

    `class Narrowing(Validated, error=CorridorError)` names the error that is raised. A class with a
    `__post_init__` of its own calls `validate` there.
    """

    __slots__ = ()
    _error: typing.ClassVar[type[InputError]] = InputError

    def __init_subclass__(cls, error: type[InputError] | None = None) -> None:
        if error is not None:  # a dataclass with slots is made twice, the second time without it
            cls._error = error
        kept: Any = cls
        _PENDING.append(partial(_turns, kept))

    def __post_init__(self) -> None:
        validate(self)


def prepare() -> None:
    """Read the annotations of all doors, in some milliseconds: the first call of each would do it."""
    while _PENDING:
        _PENDING.pop()()


class _Unfit(TypeError):
    """`value`, at the place `where` of an argument, is not what is wanted."""

    def __init__(self, wanted: str, value: Any, where: str = "") -> None:
        super().__init__(wanted)
        self.wanted, self.value, self.where = wanted, value, where


def validated(
    error: type[InputError] = InputError, *, late: bool = False
) -> Callable[[Callable[Given, Result]], Callable[Given, Result]]:
    """Decorate a public function: its arguments are turned into what its annotations say, or refused.

    Args:
        error: class of what is raised.
        late: the arguments are looked at, and turned, only after the function has failed with them as they
            are. For functions without side effects that are called many times a cycle.
    """

    def decorated(function: Callable[Given, Result]) -> Callable[Given, Result]:
        @wraps(function)
        def checked(*args: Given.args, **kwargs: Given.kwargs) -> Result:
            positional, turns = _turns(function)
            names = (*positional, *[""] * len(args))
            turned: Any = [_turn(turns.get(names[i]), each, names[i], error) for i, each in enumerate(args)]
            named: Any = {name: _turn(turns.get(name), each, name, error) for name, each in kwargs.items()}
            return function(*turned, **named)

        @wraps(function)
        def explained(*args: Given.args, **kwargs: Given.kwargs) -> Result:
            try:
                return function(*args, **kwargs)
            except InputError:
                raise
            except Exception:
                return checked(*args, **kwargs)

        _PENDING.append(partial(_turns, function))
        return explained if late else checked

    return decorated


def validate(given: Validated) -> None:
    """Turn the fields of a `Validated` dataclass into what their annotations say; for its `__post_init__`."""
    kind: Any = type(given)
    for name, turn in _turns(kind)[1].items():
        value = getattr(given, name)
        turned = _turn(turn, value, f"{kind.__name__}.{name}", kind._error)
        if turned is not value:
            object.__setattr__(given, name, turned)


def to_float(value: Any) -> float:
    """Turn a number of any kind, but truth values, into a float. Raises TypeError."""
    if type(value) is float:  # as nearly all are
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise _Unfit("a number", value)
    try:
        return float(value)
    except OverflowError:
        return inf if value > 0 else -inf  # type: ignore[operator]


def to_floats(values: Any) -> Array:
    """Turn anything that holds numbers into a contiguous array of floats. Raises TypeError."""
    try:
        found = np.asarray(values)
        if found.dtype.kind == "O":
            found = np.array([to_float(each) for each in found.flat]).reshape(found.shape)
        if found.dtype.kind in "iuf" or not found.size:
            return np.ascontiguousarray(found, dtype=np.float64)
    except BAD_INPUT:
        pass
    raise _Unfit("an array of numbers", values)


def to_rows(values: Any, width: int, name: str, error: type[InputError] = InputError) -> Array:
    """Turn anything that holds numbers into a contiguous array (n, width) of floats, all finite, or raise."""
    try:
        found = to_floats(values)
    except TypeError:
        raise error(f"{name} = {shown(values)}: must be numbers of shape (n, {width}).") from None
    if found.ndim != 2 or found.shape[1] != width:
        raise error(f"{name} has shape {found.shape}, it must be (n, {width}).")
    if not np.isfinite(found).all():
        i = int(np.argmin(np.isfinite(found).all(axis=1)))
        raise error(f"{name}[{i}] = {found[i].tolist()}: must be finite numbers.")
    return found


def _turn(turn: Turn | None, value: Any, where: str, error: type[InputError]) -> Any:
    if turn is None:
        return value
    try:
        return turn(value)
    except _Unfit as unfit:
        raise error(f"{where}{unfit.where} = {shown(unfit.value)}: must be {unfit.wanted}") from None


@cache
def _turns(function: Callable[..., Any]) -> tuple[tuple[str, ...], dict[str, Turn]]:
    """Names of the positional parameters of a function, or of a dataclass, and of all parameters what turns
    their arguments."""
    hints, parameters = typing.get_type_hints(function), signature(function).parameters
    positional = tuple(each.name for each in parameters.values() if each.kind is not Parameter.KEYWORD_ONLY)
    return positional, {name: _turn_to(hints[name]) for name in parameters if name in hints}


def _turn_to(hint: Any) -> Turn:
    origin, parts = get_origin(hint), get_args(hint)
    if hint in _SIMPLE:
        return _SIMPLE[hint]
    if is_array(hint) or hint is numpy.typing.ArrayLike:
        return to_floats
    if origin is Literal:
        return partial(_one_of, parts)
    if origin in (typing.Union, types.UnionType):
        arrays = get_args(numpy.typing.ArrayLike) or (numpy.typing.ArrayLike,)  # since numpy 2.5 a name
        if not set(arrays) <= set(parts):
            return _any_of([_turn_to(each) for each in parts])
        return _any_of([*(_turn_to(each) for each in parts if each not in arrays), to_floats])
    if origin in (tuple, list, Sequence):
        fixed = origin is tuple and Ellipsis not in parts
        return partial(_sequence, [_turn_to(each) for each in (parts if fixed else parts[:1])], fixed)
    if Callable in (origin, hint):
        return _instance(Callable, "a function")
    if origin is PathLike:
        return _instance(PathLike, "a path")
    if isinstance(hint, type):
        return _instance(hint, f"{'an' if hint.__name__[0] in 'AEIOU' else 'a'} {hint.__name__}")
    return _SIMPLE[Any]


def _instance(kinds: Any, wanted: str, made: Turn = lambda value: value) -> Turn:
    def turn(value: Any) -> Any:
        if not isinstance(value, kinds):
            raise _Unfit(wanted, value)
        return made(value)

    return turn


def _whole(value: Any) -> int:
    if isinstance(value, Integral) and not isinstance(value, bool):
        return int(value)
    found = to_float(value)
    if not found.is_integer():
        raise _Unfit("a whole number", value)
    return int(found)


def _one_of(values: Sequence[Any], value: Any) -> Any:
    if not any(type(value) is type(each) and value == each for each in values):
        raise _Unfit(" or ".join(map(repr, values)), value)
    return value


def _any_of(turns: Sequence[Turn]) -> Turn:
    """The first that takes the value; None is tried first, an array last."""
    ordered = sorted(turns, key=lambda turn: (turn is not _nothing, turn is to_floats))

    def turn(value: Any) -> Any:
        failed = []
        for each in ordered:
            try:
                return each(value)
            except _Unfit as unfit:
                failed.append(unfit)
        inner = [unfit for unfit in failed if unfit.where]
        if inner and to_floats not in turns:  # it has the right form, and something in it is wrong
            raise inner[0]
        wanted = " or ".join(dict.fromkeys(unfit.wanted for unfit in reversed(failed)))
        raise _Unfit(wanted, value)

    return turn


def _sequence(turns: Sequence[Turn], fixed: bool, value: Any) -> tuple[Any, ...]:
    """A tuple of values that one `turn` takes, or, if their number is `fixed`, each of them its own."""
    kind = "numbers" if all(turn is to_float for turn in turns) else "values"
    wanted = f"{len(turns)} {kind}" if fixed else "a sequence"
    if isinstance(value, str | bytes | Mapping | Set) or not isinstance(value, Iterable):
        raise _Unfit(wanted, value)
    items, found = list(value), []
    if fixed and len(items) != len(turns):
        raise _Unfit(wanted, value)
    for i, each in enumerate(items):
        try:
            found.append(turns[i if fixed else 0](each))
        except _Unfit as unfit:
            raise _Unfit(unfit.wanted, unfit.value, f"[{i}]{unfit.where}") from None
    return tuple(found)


_nothing: Final = _instance(types.NoneType, "None")
_SIMPLE: Final[dict[Any, Turn]] = {
    float: to_float,
    int: _whole,
    bool: _instance(bool | np.bool_, "True or False", bool),
    str: _instance(str, "text", str),
    types.NoneType: _nothing,
    **dict.fromkeys((object, Any), lambda value: value),
}

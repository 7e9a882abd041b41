"""Doors: arguments of public functions, turned into what the inside wants, or refused in one sentence.

The annotations of a function say what it takes. `door` turns numbers of all kinds (whole ones, numpy's,
float32) into floats, and anything that holds numbers into a contiguous array of floats. An argument that is
none of it raises with its name, its value and what is wanted.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import fields, is_dataclass
from functools import cache, partial, wraps
from inspect import Parameter, signature
from numbers import Integral, Real
from os import PathLike
from typing import Any, Final, Literal, ParamSpec, TypeVar, get_args, get_origin

import numpy as np
import numpy.typing

from geometry.arrays import Array
from geometry.errors import InputError, shown

Given = ParamSpec("Given")
Result = TypeVar("Result")
Turn = Callable[[Any], Any]
"""Turns a value into what is wanted; raises `_Unfit` where it cannot."""

_NUMBERS: Final = "iuf"


_PENDING: list[Callable[..., Any]] = []
"""Doors whose annotations nobody has read yet."""


class Admitted:
    """Base of dataclasses whose fields are turned by `admit`, so that `prepare` knows them."""

    __slots__ = ()

    def __init_subclass__(cls) -> None:
        """Keep the class for `prepare`."""
        kept: Any = cls
        _PENDING.append(partial(_turns_of_fields, kept))


def prepare() -> None:
    """Read the annotations of all doors, in some milliseconds: the first call of each would do it."""
    while _PENDING:
        _PENDING.pop()()


class _Unfit(Exception):
    """A value is not what is wanted, which is the text of this; `value`: of the part that is not."""

    def __init__(self, wanted: str, value: Any, where: str = "") -> None:
        super().__init__(wanted)
        self.wanted, self.value, self.where = wanted, value, where


def door(
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
            turned, named = _turned(function, args, kwargs, error)
            return function(*turned, **named)

        @wraps(function)
        def explained(*args: Given.args, **kwargs: Given.kwargs) -> Result:
            try:
                return function(*args, **kwargs)
            except InputError:
                raise
            except Exception:
                turned, named = _turned(function, args, kwargs, error)
                return function(*turned, **named)

        _PENDING.append(partial(_turns, function))
        return explained if late else checked

    return decorated


def admit(given: Admitted, error: type[InputError] = InputError) -> None:
    """Turn the fields of an `Admitted` dataclass into what their annotations say; for its `__post_init__`."""
    kind: Any = type(given)
    for name, turn in _turns_of_fields(kind):
        value = getattr(given, name)
        turned = _turn(turn, value, f"{kind.__name__}.{name}", error)
        if turned is not value:
            object.__setattr__(given, name, turned)


def numbers(values: Any) -> Array:
    """Turn anything that holds numbers into a contiguous array of floats.

    Raises:
        TypeError: it holds something that is no number, or rows of different lengths.
    """
    try:
        found = np.asarray(values)
    except (TypeError, ValueError, OverflowError) as error:
        raise TypeError("no numbers") from error
    if found.dtype.kind == "O" and all(_is_number(each) for each in found.flat):
        with np.errstate(over="ignore"):
            found = np.array([_float(each) for each in found.flat]).reshape(found.shape)
    if found.dtype.kind not in _NUMBERS and found.size:
        raise TypeError("no numbers")
    return np.ascontiguousarray(found, dtype=np.float64)


def rows(values: Any, width: int, name: str, error: type[InputError] = InputError) -> Array:
    """Turn anything that holds numbers into a contiguous array (n, width) of floats.

    Raises:
        InputError: of the class `error`; it holds something else, has another shape, or is not finite.
    """
    try:
        found = numbers(values)
    except TypeError:
        raise error(f"{name} = {shown(values)}: must be numbers of shape (n, {width}).") from None
    if found.ndim != 2 or found.shape[1] != width:
        raise error(f"{name} has shape {found.shape}, it must be (n, {width}).")
    if not np.isfinite(found).all():
        raise error(f"{name} must be finite numbers.")
    return found


def number(value: Any) -> float:
    """Turn a number of any kind, but truth values, into a float.

    Raises:
        TypeError: it is none.
    """
    if type(value) is float:  # as nearly all are
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not _is_number(value):
        raise TypeError("no number")
    return _float(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool | np.bool_)


def _float(value: Any) -> float:
    try:
        return float(value)
    except OverflowError:
        return float("inf") if value > 0 else float("-inf")


def _turned(
    function: Callable[..., Any], args: Any, kwargs: Any, error: type[InputError]
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """The arguments as the function wants them."""
    positional, turns = _turns(function)
    given = []
    for i, value in enumerate(args):
        name = positional[i] if i < len(positional) else ""
        given.append(_turn(turns.get(name), value, name, error))
    named = {name: _turn(turns.get(name), value, name, error) for name, value in kwargs.items()}
    return tuple(given), named


def _turn(turn: Turn | None, value: Any, where: str, error: type[InputError]) -> Any:
    if turn is None:
        return value
    try:
        return turn(value)
    except _Unfit as unfit:
        raise error(f"{where}{unfit.where} = {shown(unfit.value)}: must be {unfit.wanted}") from None


@cache
def _turns(function: Callable[..., Any]) -> tuple[tuple[str, ...], dict[str, Turn]]:
    """Names of the positional parameters of a function, and of all parameters what turns their arguments."""
    hints = typing.get_type_hints(function)
    parameters = signature(function).parameters.values()
    positional = tuple(each.name for each in parameters if each.kind is not Parameter.KEYWORD_ONLY)
    return positional, {name: _turn_to(hint) for name, hint in hints.items() if name != "return"}


@cache
def _turns_of_fields(cls: Any) -> tuple[tuple[str, Turn], ...]:
    if not is_dataclass(cls):  # one that another with slots has taken the place of
        return ()
    hints = typing.get_type_hints(cls)
    return tuple((each.name, _turn_to(hints[each.name])) for each in fields(cls) if each.init)


def _turn_to(hint: Any) -> Turn:
    """What turns a value into what an annotation says."""
    origin = get_origin(hint)
    if hint in _SIMPLE:
        return _SIMPLE[hint]
    if origin is np.ndarray:
        return _array
    if origin is Literal:
        return _one_of(get_args(hint))
    if origin in (typing.Union, types.UnionType):
        parts, arrays = get_args(hint), get_args(numpy.typing.ArrayLike)
        if not set(arrays) <= set(parts):
            return _any_of([_turn_to(each) for each in parts])
        return _any_of([*(_turn_to(each) for each in parts if each not in arrays), _array])
    if origin is tuple and Ellipsis not in get_args(hint):
        return _row([_turn_to(each) for each in get_args(hint)])
    if origin in (tuple, list, Sequence):
        return _sequence(_turn_to(get_args(hint)[0]))
    if origin is Callable or hint is Callable:
        return _callable
    if origin is PathLike:
        return _instance(PathLike, "a path")
    if isinstance(hint, type) and getattr(
        hint, "_is_runtime_protocol", not getattr(hint, "_is_protocol", False)
    ):
        return _instance(hint, f"{'an' if hint.__name__[0] in 'AEIOU' else 'a'} {hint.__name__}")
    return _anything


def _number(value: Any) -> float:
    try:
        return number(value)
    except TypeError:
        raise _Unfit("a number", value) from None


def _whole(value: Any) -> int:
    if isinstance(value, Integral) and not isinstance(value, bool):
        return int(value)
    found = _number(value)
    if not found.is_integer():
        raise _Unfit("a whole number", value)
    return int(found)


def _truth(value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise _Unfit("True or False", value)
    return bool(value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise _Unfit("text", value)
    return str(value)


def _nothing(value: Any) -> None:
    if value is not None:
        raise _Unfit("None", value)


def _callable(value: Any) -> Any:
    if not callable(value):
        raise _Unfit("a function", value)
    return value


def _anything(value: Any) -> Any:
    return value


def _array(value: Any) -> Array:
    try:
        return numbers(value)
    except TypeError:
        raise _Unfit("an array of numbers", value) from None


def _instance(of: type, wanted: str) -> Turn:
    def turn(value: Any) -> Any:
        if not isinstance(value, of):
            raise _Unfit(wanted, value)
        return value

    return turn


def _one_of(values: tuple[Any, ...]) -> Turn:
    def turn(value: Any) -> Any:
        if not any(type(value) is type(each) and value == each for each in values):
            raise _Unfit(" or ".join(map(repr, values)), value)
        return value

    return turn


def _any_of(turns: Sequence[Turn]) -> Turn:
    """The first that takes the value; None is tried first, an array last."""
    ordered = sorted(turns, key=lambda turn: (turn is not _nothing, turn is _array))

    def turn(value: Any) -> Any:
        failed = []
        for each in ordered:
            try:
                return each(value)
            except _Unfit as unfit:
                failed.append(unfit)
        inner = [unfit for unfit in failed if unfit.where]
        if inner and _array not in turns:  # it has the right form, and something in it is wrong
            raise inner[0]
        wanted = " or ".join(dict.fromkeys(unfit.wanted for unfit in reversed(failed)))
        raise _Unfit(wanted, value)

    return turn


def _items(value: Any, wanted: str) -> list[Any]:
    if isinstance(value, str | bytes | Mapping | Set) or not isinstance(value, Iterable):
        raise _Unfit(wanted, value)
    return list(value)


def _row(turns: Sequence[Turn]) -> Turn:
    wanted = f"{len(turns)} values" if any(turn is not _number for turn in turns) else f"{len(turns)} numbers"

    def turn(value: Any) -> tuple[Any, ...]:
        items = _items(value, wanted)
        if len(items) != len(turns):
            raise _Unfit(wanted, value)
        return tuple(_inside(turns[i], each, i) for i, each in enumerate(items))

    return turn


def _sequence(turn_item: Turn) -> Turn:
    def turn(value: Any) -> tuple[Any, ...]:
        return tuple(_inside(turn_item, each, i) for i, each in enumerate(_items(value, "a sequence")))

    return turn


def _inside(turn: Turn, value: Any, place: int) -> Any:
    try:
        return turn(value)
    except _Unfit as unfit:
        raise _Unfit(unfit.wanted, unfit.value, f"[{place}]{unfit.where}") from None


_SIMPLE: Final[dict[Any, Turn]] = {
    float: _number,
    int: _whole,
    bool: _truth,
    str: _text,
    type(None): _nothing,
    None: _nothing,
    object: _anything,
    Any: _anything,
}

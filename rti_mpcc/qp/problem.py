"""A QP as a value and as a file, for study off line."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from os import PathLike
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
from scipy.sparse import csc_matrix

from geometry.files import TABLE, opened
from rti_mpcc.errors import RecordingError
from rti_mpcc.qp.filling import QpValues
from rti_mpcc.qp.pattern import QpPattern
from rti_mpcc.types import Array

_VECTORS = {"q": "gradient", "l": "lower", "u": "upper", "x": "primal", "y": "dual"}
_MATRICES = {"P": "cost", "A": "constraints"}
_CSC = ("data", "indices", "indptr", "shape")


@dataclass(frozen=True, slots=True, kw_only=True)
class QpProblem:
    """One QP in scaled units: min x'Px/2 + q'x, lower <= Ax <= upper, and the guess it was begun from.

    Attributes:
        cost: P (n, n), upper triangle, CSC; gradient: q (n,).
        constraints: A (m, n), CSC; lower, upper: (m,).
        primal: (n,), dual: (m,) guess.
    """

    cost: csc_matrix
    gradient: Array
    constraints: csc_matrix
    lower: Array
    upper: Array
    primal: Array
    dual: Array


def problem_of(pattern: QpPattern, values: QpValues, primal: Array, dual: Array) -> QpProblem:
    """Copies of the numbers as they are now, in the matrices of the pattern, with a guess (n,), (m,)."""
    return QpProblem(
        cost=pattern.cost_matrix(values.cost.copy()),
        gradient=values.gradient.copy(),
        constraints=pattern.constraint_matrix(values.constraints.copy()),
        lower=values.lower.copy(),
        upper=values.upper.copy(),
        primal=primal,
        dual=dual,
    )


def dump_problem(file: str | PathLike[str], problem: QpProblem, **more: Any) -> None:
    """Write a QP as a NumPy archive (.npz): min x'Px/2 + q'x, l <= Ax <= u, begun from the guess x, y.

    P (upper triangle) and A are in CSC form: P_data, P_indices, P_indptr, P_shape, the same for A. `more` is
    written beside them; of a failed cycle: settings of the solver (JSON), cycle, time [s], status.
    """
    content = {name: getattr(problem, field) for name, field in _VECTORS.items()}
    for name, field in _MATRICES.items():
        content |= {f"{name}_{item}": getattr(getattr(problem, field), item) for item in _CSC}
    np.savez_compressed(file, **content, **more)


def load_problem(file: str | PathLike[str]) -> QpProblem:
    """The QP that `dump_problem` wrote. Raises RecordingError where it is none, or cannot be read."""
    try:
        with opened(file, TABLE) as stream, ZipFile(stream) as archive:
            if sum(each.file_size for each in archive.infolist()) > TABLE:
                raise ValueError(f"it has more than {TABLE / 1e6:g} MB")
            stream.seek(0)
            content = np.load(stream, allow_pickle=False)
            found: dict[str, Any] = {field: content[name] for name, field in _VECTORS.items()}
            for name, field in _MATRICES.items():
                data, indices, indptr, shape = (content[f"{name}_{item}"] for item in _CSC)
                found[field] = csc_matrix((data, indices, indptr), shape=tuple(shape.tolist()))
    except OSError as error:
        raise RecordingError(f"{file}: cannot be read, {error.strerror or error}") from error
    except (KeyError, ValueError, IndexError, EOFError, MemoryError, BadZipFile, zlib.error) as error:
        raise RecordingError(f"{file}: is not a QP of rti-mpcc ({error})") from error
    return QpProblem(**found)

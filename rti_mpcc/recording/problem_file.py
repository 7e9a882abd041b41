"""A QP in a file of its own, for study off line."""

from __future__ import annotations

import zlib
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile, ZipFile

import numpy as np
from scipy.sparse import csc_matrix

from geometry.files import TABLE, opened
from rti_mpcc.config import SolverSettings
from rti_mpcc.docking import DockingController
from rti_mpcc.errors import RecordingError
from rti_mpcc.qp.problem import QpProblem
from rti_mpcc.recording.contents import Cycle

_VECTORS = {"q": "gradient", "l": "lower", "u": "upper", "x": "primal", "y": "dual"}
_MATRICES = {"P": "cost", "A": "constraints"}


def dump_problem(
    file: str | PathLike[str],
    problem: QpProblem,
    settings: SolverSettings,
    *,
    cycle: int,
    time: float,
    status: str,
) -> None:
    """Write a QP as a NumPy archive (.npz): min x'Px/2 + q'x, l <= Ax <= u, begun from the guess x, y.

    P (upper triangle) and A are in CSC form: P_data, P_indices, P_indptr, P_shape, the same for A.

    Args:
        file: to write; its folder must exist.
        problem: the QP; settings: of the solver, written as JSON.
        cycle: number in its recording; time: of the cycle [s]; status: how the solver ended.
    """
    content: dict[str, Any] = {name: getattr(problem, field) for name, field in _VECTORS.items()}
    for name, field in _MATRICES.items():
        matrix = getattr(problem, field)
        content |= {
            f"{name}_{item}": getattr(matrix, item) for item in ("data", "indices", "indptr", "shape")
        }
    content |= {"settings": settings.model_dump_json(), "cycle": cycle, "time": time, "status": status}
    np.savez_compressed(file, **content)


def load_problem(file: str | PathLike[str]) -> QpProblem:
    """The QP that `dump_problem` wrote.

    Raises:
        RecordingError: the file cannot be read or is no such archive.
    """
    try:
        with opened(file, TABLE) as stream:
            _refuse_large(stream)
            content = np.load(stream, allow_pickle=False)
            found: dict[str, Any] = {field: content[name] for name, field in _VECTORS.items()}
            found |= {field: _matrix(content, name) for name, field in _MATRICES.items()}
    except OSError as error:
        raise RecordingError(f"{file}: cannot be read, {error.strerror or error}") from error
    except (KeyError, ValueError, IndexError, EOFError, MemoryError, BadZipFile, zlib.error) as error:
        raise RecordingError(f"{file}: is not a QP of rti-mpcc ({error})") from error
    return QpProblem(**found)


def _refuse_large(stream: BinaryIO) -> None:
    """Raise ValueError for an archive that is far larger unpacked. Raises BadZipFile for none."""
    with ZipFile(stream) as archive:
        if sum(each.file_size for each in archive.infolist()) > TABLE:
            raise ValueError(f"it has more than {TABLE / 1e6:g} MB")
    stream.seek(0)


def _matrix(content: Any, name: str) -> csc_matrix:
    data, indices, indptr = (content[f"{name}_{item}"] for item in ("data", "indices", "indptr"))
    return csc_matrix((data, indices, indptr), shape=tuple(content[f"{name}_shape"].tolist()))


def dump_if_failed(controller: DockingController, cycle: Cycle, folder: Path) -> Path | None:
    """Write the last QP of a cycle just driven, if it has one and failed; returns the file.

    After a mistake of the program there is none: the controller has begun afresh.
    """
    command = cycle.command
    if command is None or not command.diagnostics.failed or not command.diagnostics.solver_status:
        return None
    file = folder / f"qp_{cycle.number:06d}.npz"
    dump_problem(
        file,
        controller.problem(),
        controller.config.solver,
        cycle=cycle.number,
        time=cycle.inputs.now,
        status=command.diagnostics.solver_status,
    )
    return file

"""[goal.camera]: a camera on the vehicle and the board at the goal."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from estimation import Camera, CharucoBoard
from estimation.charuco import opencv_board
from rti_mpcc.simulation.camera import Optics
from rti_mpcc.simulation.sections.base import KeyProblem, ListOf, NotNegative, Pair, Section, Triple


class OtherBoardSection(Section):
    """The board of another dock: pose of that dock, x, y [m], heading [rad]; number of its first marker."""

    pose: Triple
    first_marker: int = Field(ge=0)


class WrongSection(Section):
    """One wrong detection: `after` so long after the first one [s] the dock is seen off by `offset`, in its
    own frame (longitudinal [m], lateral [m], heading [rad])."""

    after: NotNegative
    offset: Triple


class CameraSection(Section):
    """A camera on the vehicle and the board at the goal, in place of random detections.

    Attributes:
        mount: the assumed camera; board: at the goal; optics: of its pictures; others: boards of other docks.
        exact: the camera is mounted as assumed; else height, pitch and roll have random errors.
        lost: nothing is detected between these times after the first detection [s]; wrong: see there.
    """

    mount: Camera = Camera()
    board: CharucoBoard = CharucoBoard()
    optics: Optics = Optics()
    exact: bool = False
    others: ListOf[OtherBoardSection] = ()
    lost: Pair | None = None
    wrong: WrongSection | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if self.lost is not None and not 0.0 <= self.lost[0] < self.lost[1]:
            allowed = "must be two times after the first detection, the later one last"
            yield KeyProblem("lost", list(self.lost), allowed)
        own = self.board
        keys = ["board", *(f"others[{index}]" for index in range(len(self.others)))]
        for key, board in zip(keys, (own, *self.other_boards), strict=True):
            size = board.dictionary_size
            if size is not None and board.markers.stop > size:
                room = f"must leave room for its {len(board.markers)} markers"
                allowed = f"{room}, {board.dictionary!r} has 0 to {size - 1}"
            elif board is not own and own.shares_markers(board):
                taken = f"{own.markers.start} to {own.markers.stop - 1}"
                allowed = f"must leave the markers {taken} to the board at the goal"
            else:
                continue
            yield KeyProblem(f"{key}.first_marker", board.first_marker, allowed)

    @property
    def other_boards(self) -> tuple[CharucoBoard, ...]:
        """The boards of `others`, like the one at the goal but for their markers."""
        return tuple(self.board.changed(first_marker=other.first_marker) for other in self.others)

    def check(self) -> None:
        """Check whether pictures can be taken. Raises MissingExtraError without OpenCV, ConfigError for a
        board whose dictionary is unknown or too small."""
        for board in (self.board, *self.other_boards):
            opencv_board(board)

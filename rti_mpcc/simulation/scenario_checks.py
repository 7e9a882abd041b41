"""What the values of a scenario must be to one another; each problem names key, value and what is allowed."""

from __future__ import annotations

from collections.abc import Iterator
from math import tan

from geometry import Corridor, Pose2, ReferencePath
from geometry.angles import degrees_hint
from rti_mpcc.config import COMFORT_ACCELERATION
from rti_mpcc.errors import InputError
from rti_mpcc.planning import goals
from rti_mpcc.simulation.faults import SIZES
from rti_mpcc.simulation.fields import area_problems, map_problem, polygon_problems
from rti_mpcc.simulation.mission import problems_of
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.scenario_camera import CameraSection
from rti_mpcc.simulation.toml_file import Problem

_EITHER = "either [path] and [corridor], or [start], [area] and goal.pose"


def problems(scenario: Scenario) -> list[Problem]:
    """Everything wrong that single values do not show; later checks only run where earlier ones passed."""
    ground = (_area_choice,) if scenario.in_area else (_path_choice, _corridor_choice)
    checks = (
        _ground_choice,
        *ground,
        _goal_choice,
        _ranges,
        _camera,
        _clock,
        _comfort,
        _faults,
        _body,
        _mission,
    )
    found = [problem for check in checks for problem in check(scenario)]
    if found:
        return found
    return _problems_in_area(scenario) if scenario.in_area else _problems_on_path(scenario)


def _problems_on_path(scenario: Scenario) -> list[Problem]:
    """Of path, corridor and goals, in this order; later ones are only looked at where earlier ones can be."""
    try:
        path = scenario.build_path()
    except InputError as error:
        return [Problem(key=_path_key(scenario), value=scenario.path.file, allowed=str(error))]
    found = list(_narrowings(scenario, path))
    if found:
        return found
    try:
        corridor = scenario.build_corridor(path)
    except InputError as error:
        return [Problem(key="corridor", value=None, allowed=str(error))]
    return [*_width(scenario, corridor), *_goals(scenario, path, corridor), *_settings(scenario)]


def _problems_in_area(scenario: Scenario) -> list[Problem]:
    """Of the area's map; whether a goal is in reach shows when the way to it is planned."""
    assert scenario.area is not None
    try:
        scenario.build_area()
    except InputError as error:
        return [map_problem(scenario.area, error)]
    return list(_settings(scenario))


def _settings(scenario: Scenario) -> Iterator[Problem]:
    try:
        scenario.controller_config("default")
    except InputError as error:
        yield Problem(key="controller", value=None, allowed=str(error))


def remarks(scenario: Scenario) -> list[str]:
    """What is allowed but will show: one line each."""
    headings = [hint for name, pose in _poses(scenario) if (hint := degrees_hint(name, pose[2]))]
    return [*headings, *_bends(scenario)]


def _poses(scenario: Scenario) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """All poses of a file, by the key of their headings."""
    if scenario.start is not None:
        yield "start.pose[2]", scenario.start.pose
    if scenario.given_path is not None and scenario.given_path.start is not None:
        yield "path.start[2]", scenario.given_path.start
    if scenario.goal.pose is not None:
        yield "goal.pose[2]", scenario.goal.pose
    if scenario.goal.offset is not None:
        yield "goal.offset[2]", scenario.goal.offset
    if scenario.home is not None:
        yield "home.pose[2]", scenario.home.pose


def _bends(scenario: Scenario) -> list[str]:
    """That the path bends more sharply than the vehicle can."""
    if scenario.in_area:
        return []
    path = scenario.build_path()
    possible = tan(scenario.limits.steering) / scenario.vehicle.wheelbase
    if path.max_curvature <= possible * (1.0 + 1e-9):
        return []
    return [
        f"path: its largest curvature {path.max_curvature:.4g} 1/m is more than the vehicle can steer "
        f"(tan(limits.steering) / vehicle.wheelbase = {possible:.4g} 1/m); it is made smooth or left there"
    ]


def _ground_choice(scenario: Scenario) -> Iterator[Problem]:
    """Whether there is a path with its corridor or a start in an area with the goal's pose, and not both."""
    on_path = {"path": scenario.given_path, "corridor": scenario.given_corridor}
    in_area = {"start": scenario.start, "area": scenario.area}
    given = [key for key, section in in_area.items() if section is not None]
    if given and any(section is not None for section in on_path.values()):
        for key in given:
            yield Problem(key=key, value=None, allowed=f"{_EITHER}, not both")
        return
    needed = {**in_area, "goal.pose": scenario.goal.pose} if given else on_path
    for key, section in needed.items():
        if section is None:
            yield Problem(key=key, value=None, allowed=f"required: {_EITHER}")


def _area_choice(scenario: Scenario) -> Iterator[Problem]:
    section = scenario.area
    if section is not None:
        yield from area_problems(section)
    if scenario.goal.offset is not None:
        allowed = "only with [path], from whose end it is counted: give goal.pose"
        yield Problem(key="goal.offset", value=scenario.goal.offset, allowed=allowed)
    if (time := scenario.controller.docking_time) is not None:
        allowed = "only with [path]: how long an unknown way takes is not known before"
        yield Problem(key="controller.docking_time", value=time, allowed=allowed)


def _path_choice(scenario: Scenario) -> Iterator[Problem]:
    path = scenario.given_path
    if path is None:
        return
    if path.file is not None and (path.start is not None or path.segments is not None):
        yield Problem(
            key="path.file", value=path.file, allowed="either file, or start and segments, not both"
        )
    elif path.file is None:
        for key in ("start", "segments"):
            if getattr(path, key) is None:
                yield Problem(key=f"path.{key}", value=None, allowed="required where path.file is not given")


def _corridor_choice(scenario: Scenario) -> Iterator[Problem]:
    corridor = scenario.given_corridor
    if corridor is None:
        return
    for key in ("left", "right"):
        if corridor.polygon is None and getattr(corridor, key) is None:
            yield Problem(
                key=f"corridor.{key}", value=None, allowed="required where corridor.polygon is not given"
            )
        if corridor.polygon is not None and getattr(corridor, key) is not None:
            yield Problem(
                key=f"corridor.{key}",
                value=getattr(corridor, key),
                allowed="either polygon, or left and right, not both",
            )
    if corridor.polygon is not None and corridor.narrowings:
        yield Problem(
            key="corridor.narrowings",
            value=f"{len(corridor.narrowings)} tables",
            allowed="only with left and right, not with polygon",
        )


def _goal_choice(scenario: Scenario) -> Iterator[Problem]:
    if scenario.goal.offset is not None and scenario.goal.pose is not None:
        yield Problem(key="goal.pose", value=scenario.goal.pose, allowed="either offset or pose, not both")


def _ranges(scenario: Scenario) -> Iterator[Problem]:
    section = scenario.goal.measurement
    if section is not None and section.blind_range >= section.visible_range:
        allowed = f"must be < goal.measurement.visible_range = {section.visible_range}"
        yield Problem(key="goal.measurement.blind_range", value=section.blind_range, allowed=allowed)


def _camera(scenario: Scenario) -> Iterator[Problem]:
    section = scenario.goal.camera
    if section is None:
        return
    if scenario.goal.measurement is None:
        allowed = "needs [goal.measurement], which says when and how far it sees"
        yield Problem(key="goal.camera", value=None, allowed=allowed)
    if section.lost is not None and not 0.0 <= section.lost[0] < section.lost[1]:
        allowed = "must be two times after the first detection, the later one last"
        yield Problem(key="goal.camera.lost", value=list(section.lost), allowed=allowed)
    yield from _markers(section)


def _markers(section: CameraSection) -> Iterator[Problem]:
    """Of each board: whether its dictionary has them, and whether they are those of the board at the goal."""
    own = section.board
    keys = ["goal.camera.board", *(f"goal.camera.others[{index}]" for index in range(len(section.others)))]
    for key, board in zip(keys, (own, *section.other_boards), strict=True):
        size, needed = board.dictionary_size, len(board.markers)
        if size is not None and board.markers.stop > size:
            allowed = f"must leave room for its {needed} markers, {board.dictionary!r} has 0 to {size - 1}"
        elif board is not own and own.shares_markers(board):
            taken = f"{own.markers.start} to {own.markers.stop - 1}"
            allowed = f"must leave the markers {taken} to the board at the goal"
        else:
            continue
        yield Problem(key=f"{key}.first_marker", value=board.first_marker, allowed=allowed)


def _clock(scenario: Scenario) -> Iterator[Problem]:
    simulation = scenario.simulation
    if simulation.plant_step > simulation.cycle:
        yield Problem(
            key="simulation.plant_step",
            value=simulation.plant_step,
            allowed=f"must be <= simulation.cycle = {simulation.cycle}",
        )


def _comfort(scenario: Scenario) -> Iterator[Problem]:
    comfort = scenario.controller.comfort_acceleration
    if comfort is None:
        comfort = COMFORT_ACCELERATION
    if comfort > scenario.limits.acceleration:
        yield Problem(
            key="controller.comfort_acceleration",
            value=comfort,
            allowed=f"must be <= limits.acceleration = {scenario.limits.acceleration}",
        )


def _faults(scenario: Scenario) -> Iterator[Problem]:
    for index, fault in enumerate(scenario.faults):
        if fault.end <= fault.begin:
            yield Problem(
                key=f"faults[{index}].to", value=fault.end, allowed=f"must be > from = {fault.begin}"
            )
        size = SIZES.get(fault.kind)
        if size is not None and not size.above < fault.amount < size.below:
            allowed = f"must be > {size.above:g} and < {size.below:g} for {fault.kind}"
            yield Problem(key=f"faults[{index}].size", value=fault.size, allowed=allowed)


def _body(scenario: Scenario) -> Iterator[Problem]:
    body = scenario.goal.body
    if body is None:
        return
    if not scenario.mission:
        yield Problem(key="goal.body", value=None, allowed="only with [[mission]], which keeps clear of it")
    yield from polygon_problems("goal.body", body)


def _mission(scenario: Scenario) -> Iterator[Problem]:
    """Each step by itself, and against the others."""
    steps, has_body = scenario.mission, scenario.goal.body is not None
    for index, step in enumerate(steps):
        name = f"mission[{index}]"
        for key, value, allowed in problems_of(step, in_area=scenario.in_area, has_body=has_body):
            yield Problem(key=f"{name}.{key}" if key else name, value=value, allowed=allowed)
        if step.retry_from is not None and step.retry_from > index:
            allowed = f"must be <= {index}, its own place"
            yield Problem(key=f"{name}.retry_from", value=step.retry_from, allowed=allowed)
        if step.then == "home" and scenario.home is None:
            yield Problem(key=f"{name}.then", value="home", allowed="needs [home]")
    if scenario.home is not None and not steps:
        yield Problem(key="home", value=None, allowed="only with [[mission]]")


def _path_key(scenario: Scenario) -> str:
    return "path" if scenario.path.file is None else "path.file"


def _narrowings(scenario: Scenario, path: ReferencePath) -> Iterator[Problem]:
    """Each narrowing by itself, so that the message can name it."""
    section = scenario.corridor
    if section.left is None or section.right is None:
        return
    width = scenario.build_vehicle().least_width
    if section.left - section.right < width:
        value = f"{section.left} with right = {section.right}"
        yield Problem(
            key="corridor.left", value=value, allowed=f"left - right must be >= the body's width {width} m"
        )
        return
    for index, narrowing in enumerate(section.narrowings):
        key = f"corridor.narrowings[{index}]"
        left = section.left if narrowing.left is None else narrowing.left
        right = section.right if narrowing.right is None else narrowing.right
        if not narrowing.start < narrowing.end <= path.length + 1e-9:
            allowed = (
                f"must be above from = {narrowing.start} and at most the path's length {path.length:.6g}"
            )
            yield Problem(key=f"{key}.to", value=narrowing.end, allowed=allowed)
        elif narrowing.left is None and narrowing.right is None:
            yield Problem(key=key, value=None, allowed="needs left, right or both")
        elif left - right < width:
            value = f"left {left}, right {right}"
            yield Problem(key=key, value=value, allowed=f"left - right must be >= the body's width {width} m")


def _width(scenario: Scenario, corridor: Corridor) -> Iterator[Problem]:
    width, theta = corridor.narrowest()
    least = scenario.build_vehicle().least_width
    # The narrowest place is sampled: only what is clearly below the width is refused.
    if width < least - 1e-6:
        yield Problem(
            key="corridor",
            value=f"{width:.4g} m wide at {theta:.4g} m along the path",
            allowed=f"must be at least as wide as the body, {least} m",
        )


def _goals(scenario: Scenario, path: ReferencePath, corridor: Corridor) -> Iterator[Problem]:
    """The goal, planned and true, and each place it moves to: within reach of the last part, with room."""
    planned = scenario.planned_goal(path)
    if scenario.goal.measurement is not None and planned is not None:
        yield from _goal("goal.measurement.initial_offset", planned, scenario, path, corridor)
    goal = scenario.goal_pose(path)
    if not scenario.goal_is_path_end:
        yield from _goal("goal", goal, scenario, path, corridor)
    for index, shift in enumerate(scenario.goal.shifts):
        goal = goal.compose(Pose2(*shift.offset))
        yield from _goal(f"goal.shifts[{index}]", goal, scenario, path, corridor)


def _goal(
    key: str, goal: Pose2, scenario: Scenario, path: ReferencePath, corridor: Corridor
) -> Iterator[Problem]:
    problem = goals.checked(goal, path, corridor, scenario.build_vehicle()).problem
    if problem:
        value = f"pose ({goal.x:.4g}, {goal.y:.4g}, {goal.phi:.4g})"
        yield Problem(key=key, value=value, allowed=f"out of reach, {problem}")

"""What the paper says of its two scenarios, and why runs here differ: prose without measured numbers."""

from __future__ import annotations

SAYS = {
    "docking_inside": (
        "The goal lies beside the path, before its end, and is turned against it, in a wide corridor. The "
        "paper compares its method, `dynamic`, with `separated` (path following to a stop, then Cartesian "
        "MPC to the pose) and `switched` (the whole objective becomes Cartesian near the goal), and "
        "reports that both take longer, `switched` with one change of direction more."
    ),
    "docking_behind": (
        "The goal lies behind the path end, and the corridor is narrowed twice near it. The paper reports "
        "that `separated` needs about twice the time, with changes of direction, and that `switched`, "
        "which forgets the corridor near the goal, drives through the narrowing. The paper judges that on "
        "the rear axle; by the whole body the published code's `separated` touches the narrowing, too. The "
        "reason for its changes of direction: from a standstill at the path end a goal behind it and to "
        "the side cannot be reached in one move."
    ),
}
SHARED = (
    "What is different for all methods. This project keeps the whole body inside the corridor by half-"
    "planes for two boxes of the body, and checks every plan by the exact body before it is driven; the "
    "published code keeps its rear axle away from the bounds by a soft cost. Progress runs forward only "
    "here, while the published code lets it run back (deviation (f) in docs/decisions). The controller "
    "runs at 20 Hz instead of 100 Hz and docks only at rest."
)
TRACED = (
    "What `paper` needs besides the printed equations to drive as the published code, each tried by "
    "itself (deviation (n) in docs/decisions). Weights that follow the progress have their slopes in the "
    "gradient; the path's heading has none there, because that code looks it up by index. Behind the "
    "path's end the bound on speed follows from the distance behind it. `switched` switches at β of the "
    "distance along the path, not of the straight distance, and contours by Eq. 7 until then: with any "
    "one of these otherwise it reaches the goal of Scenario 1 in one move, and sooner."
)
SEPARATED_BEHIND = (
    "Why `separated` takes less time than published: up to its stop at the path's end both take about the"
    " same. From there the published run first drives forwards, then through the narrowings at no more "
    "than 0.6 m/s, its body touching them; here it drives at up to 1.1 m/s, clear of them, and comes back"
    " once. The published cost on speed near a bound is not the reason: with it in this segment, too, "
    "nothing changed. It was not traced further."
)
SWITCHED_BEHIND = (
    "Why `switched` does not leave the corridor: its plans have no corridor rows near the goal, as in the"
    " paper, but the last check of the body stays. Where a plan would cross a narrowing the vehicle "
    "brakes and stands, BLOCKED; the paper's vehicle drives through."
)
BEYOND = (
    "The preset `default` plans one arrival at rest, whose time to go falls by the elapsed time in every "
    "cycle, instead of a goal cost at the end of a horizon that recedes with the vehicle and makes it "
    "creep. It keeps the body 0.1 m inside the corridor and asks for no more."
)
FOR_BOTH = {
    "docking_inside": (SHARED, TRACED, BEYOND),
    "docking_behind": (
        "What is different for all methods, and what `default` does, is described for Scenario 1.",
    ),
}
"""Texts for both scenarios, printed once."""

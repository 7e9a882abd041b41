"""What the paper says of its two scenarios, and why runs here differ from it: prose without measured numbers."""

from __future__ import annotations

SAYS = {
    "docking_inside": (
        "The goal lies beside the last metre of the path and is turned against it, in a wide corridor. The paper "
        "compares its method, `dynamic`, with `separated` (path following to a stop, then Cartesian MPC to the pose) and "
        "`switched` (the whole objective becomes Cartesian near the goal), and reports that both take longer, `switched` "
        "with one change of direction more."
    ),
    "docking_behind": (
        "The goal lies behind the path end, and the corridor is narrowed twice near it. The paper reports that "
        "`separated` needs about twice the time, with changes of direction, and that `switched`, which forgets the "
        "corridor near the goal, drives through the narrowing. The paper judges that on the rear axle; by the whole "
        "body the published code's `separated` touches the narrowing, too."
    ),
}
_SHARED = (
    "What is different for all methods. This project keeps the whole body inside the corridor by half-planes for the "
    "discs that cover it, and checks every plan by the exact polygon of the body before it is driven; the published "
    "code keeps its rear axle away from the bounds by a soft cost. Progress runs forward only here, while the published "
    "code lets it run back (deviation (f) in docs/method.md). Weights that follow the progress have their slopes in the "
    "gradient (deviation (n)): without them `paper` drove faster than the published code and spent more. The controller "
    "runs at 20 Hz instead of 100 Hz and docks only at rest."
)
CAUSES = {
    "docking_inside": (
        _SHARED,
        "`switched`: here the Cartesian objective is linear beyond 0.5 m and 0.3 rad from the goal, so that its pull "
        "is bounded, it plans from the state it is in without a new first guess along the path, and it may go backwards "
        "and forwards; where that leads straight into the goal it is the faster way, because nothing has to follow the "
        "path any more. The change of direction of the published run comes from passing the goal with the heading "
        "off.",
    ),
    "docking_behind": (
        _SHARED,
        "`dynamic`: before the narrowings the two drive differently. The soft cost of the published code begins to act "
        "2 m from a bound and slows the vehicle where it is near one; the half-planes here act on the body as soon as "
        "the narrowings come within the horizon, and shape the plan from there on.",
        "`switched`: its plans have no corridor rows, as in the paper, but the last check of the body stays. Where a "
        "plan would cross the narrowing the vehicle brakes and stands, BLOCKED; the paper's vehicle drives "
        "through.",
        "`separated`: it stops at the path end, where the goal lies behind it and to the side. From a standstill there it "
        "cannot be reached in one move, so it turns about.",
    ),
}
BEYOND = (
    "The preset `default` plans one arrival at rest, which every cycle brings nearer by the time passed, instead of a "
    "goal cost at the end of a horizon that recedes with the vehicle and makes it creep. Its clearance is less because "
    "it keeps the body 0.1 m inside the corridor and asks for no more."
)

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
    "What is different for all methods. This project keeps the whole body inside the corridor by "
    "half-planes for the discs that cover it, and checks every plan by the exact polygon of the body "
    "before it is driven; the published code keeps its rear axle away from the bounds by a soft cost. "
    "Progress runs forward only here, while the published code lets it run back (deviation (f) in "
    "docs/method.md). Weights that follow the progress have their slopes in the gradient (deviation (n)): "
    "without them `paper` drove faster than the published code and spent more. The controller runs at 20 "
    "Hz instead of 100 Hz and docks only at rest."
)
DYNAMIC = (
    "Why `dynamic` does not take the paper's time: before the narrowings the two drive differently. The "
    "soft cost of the published code begins to act 2 m from a bound and slows the vehicle where it is near "
    "one; the half-planes here act on the body as soon as the narrowings come within the horizon, and "
    "shape the plan from there on (deviation (n)). Both hurry when the weight of the goal grows, because a "
    "goal cost at the end of a horizon asks to be there by its end; here the vehicle is slower until then "
    "and hurries more. How much each of these makes was not traced."
)
SWITCHED_INSIDE = (
    "Why `switched` comes out otherwise: the published run steers to its limit at the switch, passes the "
    "goal with its heading off, and has to come back; that is its change of direction, and most of its "
    "time. Here nothing ties the vehicle to the path any more after the switch, and it comes to the goal "
    "in one move. When it switches is not the reason. The published trajectories show the switch, a step "
    "in the steering rate or in the acceleration, where about β of the way along the path is left; here it "
    "is the straight distance to the goal that counts. Switching here where the published code does was "
    "tried: the vehicle came to the goal in one move, too. So the difference lies in the objective after "
    "the switch, or in how its plans are found (there one full step a cycle by Euler's rule, here damped "
    "steps to convergence at each change of objective); it was not traced further."
)
SWITCHED_BEHIND = (
    "Why `switched` does not leave the corridor: its plans have no corridor rows near the goal, as in the "
    "paper, but the last check of the body stays. Where a plan would cross a narrowing the vehicle brakes "
    "and stands, BLOCKED; the paper's vehicle drives through. Switching where the published code does "
    "(about β of the way along the path before its end, not β of straight distance) was tried, and ends "
    "the same way."
)
BEYOND = (
    "The preset `default` plans one arrival at rest, which every cycle brings nearer by the time passed, "
    "instead of a goal cost at the end of a horizon that recedes with the vehicle and makes it creep. It "
    "keeps the body 0.1 m inside the corridor and asks for no more."
)
FOR_BOTH = {
    "docking_inside": (SHARED, BEYOND),
    "docking_behind": ("What is different for all methods, and what `default` does, is said of Scenario 1.",),
}
"""What holds for both scenarios is said once."""

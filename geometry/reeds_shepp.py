"""The ways of Reeds and Shepp: the shortest ones of a car that drives both ways, without obstacles.

After Reeds and Shepp, "Optimal paths for a car that goes both forwards and backwards", Pacific Journal of
Mathematics 145 (1990), section 8. A word is up to five pieces, arcs of the least radius to the left (L) and
right (R) and straights (S). The radius is 1 here, so an arc is as long as it turns. From the pose (0, 0, 0),
let (r, theta) be the way from the centre of its left turn to the centre of the goal's left turn (to L) or
right turn (to R), in polar coordinates:

    to L: (x - sin phi, y - 1 + cos phi),    to R: (x + sin phi, y - 1 - cos phi)                       (RS1)

The centre moves along the straights, and by 2 where a turn follows upon the opposite one. So the words below
lead to L or R, as they end, with these lengths: t of the first piece, v of the last one, u of those between:

    L(t) S(u) L(v)                     r = u                  t = theta              v = phi - t         (RS2)
    L(t) S(u) R(v)                     r^2 = u^2 + 4          t = theta + a          v = t - phi         (RS3)
    L(t) R(u) L(v)                     r = -4 sin(u/2)        t = theta + u/2 + pi   v = phi - t + u     (RS4)
    L(t) R(u) L(-u) R(v)               r = 4 cos u - 2        t = theta + u + pi/2   v = t - 2 u - phi   (RS5)
    L(t) R(u) L(u) R(v)                r^2 = 20 - 16 cos u    t = theta + pi/2 + b   v = t - phi         (RS6)
    L(t) R(-pi/2) S(u) L(v)            r^2 = (2 - u)^2 + 4    t = theta + pi/2 + a   v = phi - t - pi/2  (RS7)
    L(t) R(-pi/2) S(u) R(v)            r = 2 - u              t = theta + pi/2       v = t + pi/2 - phi  (RS8)
    L(t) R(-pi/2) S(u) L(-pi/2) R(v)   r^2 = (4 - u)^2 + 4    t = theta + pi/2 + a   v = t - phi         (RS9)

with a = atan(2 / sqrt(r^2 - 4)) and b = atan(-sin u / (2 - cos u)). The signs and limits of u are the
paper's: u >= 0 in (RS2), (RS3), (RS5), u <= 0 in the others, and at most a quarter turn in (RS6).

The others follow by symmetry: the word of (-x, y, -phi) driven in the other direction, that of (x, -y, -phi)
with left and right exchanged, and both. (RS7), (RS8) may also be driven from the goal to the start: these are
the words of (x cos phi + y sin phi, x sin phi - y cos phi, phi) in reverse order.

Angles t and v are taken in (-pi, pi], whatever signs they have there. So the paper's 12 words of three turns
are four here, which leaves room for some that it has not: where t or v are negative in (RS2), (RS3), the same
word also without a change of direction, with turns of up to 2 pi. It is longer, but may be cheaper.
"""

from __future__ import annotations

from math import acos, asin, atan2, cos, floor, inf, pi, sin, sqrt
from typing import Final, TypeAlias

import numpy as np

from geometry.arrays import Array
from geometry.compiled import inner

PIECES: Final = 5
"""Of a word, at most."""
WORDS: Final = 48
"""At most."""

_ZERO: Final = 1e-10  # [radii] a piece that is shorter is none
_SAME: Final = 1e-12  # so near the end of its domain an equation is solved as if at it: no root of rounding

_Lengths: TypeAlias = tuple[float, float, float, float, float]

# The first word to either centre is also driven from the goal to the start.
_LRSL, _LSL, _LRL = 0, 1, 2
_LRSR, _LSR, _LRLR_OPPOSED, _LRLR_ALIKE, _LRSLR = 3, 4, 5, 6, 7
_TO_L, _TO_R, _STOP = 0, 3, 8
_TURNS: Final = np.array(
    [
        [1.0, -1.0, 0.0, 1.0, 0.0],
        [1.0, 0.0, 1.0, 0.0, 0.0],
        [1.0, -1.0, 1.0, 0.0, 0.0],
        [1.0, -1.0, 0.0, -1.0, 0.0],
        [1.0, 0.0, -1.0, 0.0, 0.0],
        [1.0, -1.0, 1.0, -1.0, 0.0],
        [1.0, -1.0, 1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0, 1.0, -1.0],
    ]
)


@inner
def words(x: float, y: float, phi: float, lengths: Array, turns: Array) -> int:
    """Find the words from (0, 0, 0) to x, y [radii], phi [rad, any branch].

    Args:
        lengths: (WORDS, PIECES) [radii], filled: negative in reverse, 0 where there is no piece.
        turns: (WORDS, PIECES), filled: 1 to the left, -1 to the right, 0 straight.

    Returns how many words there are.
    """
    phi = _wrapped(phi)
    s, c = sin(phi), cos(phi)
    count = 0
    for symmetry in range(8):
        flip, mirror, reverse = _symmetry(symmetry)
        px, py = (x * c + y * s, x * s - y * c) if reverse else (x, y)
        px, py, turn, sine = flip * px, mirror * py, flip * mirror * phi, flip * mirror * s
        for right in range(2):
            r, theta = _centre(px, py, sine, c, right)
            first, stop = (_TO_R, _STOP) if right else (_TO_L, _TO_R)
            for word in range(first, first + 1 if reverse else stop):
                t, u, v = _solved(word, r, theta, turn)
                if t == inf:
                    continue
                _put(word, _pieces(word, t, u, v), symmetry, lengths[count], turns[count])
                count += 1
                if word in (_LSL, _LSR) and min(t, v) < -_ZERO:
                    t, v = _onward(t), _onward(v)
                    _put(word, _pieces(word, t, u, v), symmetry, lengths[count], turns[count])
                    count += 1
    return count


@inner
def least_cost(x: float, y: float, phi: float, radius: float, back: float, cusp: float) -> float:
    """Return the least cost [m] of the words from (0, 0, 0) to x, y [m], phi [rad, any branch].

    With back = 1, cusp = 0 it is the length of the shortest way there is. With other costs there may be a
    cheaper way that is no such word.

    Args:
        radius: of the arcs [m].
        back: cost of a metre in reverse; forward it is 1.
        cusp: cost of a change of direction [m].
    """
    phi = _wrapped(phi)
    s, c = sin(phi), cos(phi)
    x, y, cusp = x / radius, y / radius, cusp / radius
    best = inf
    for symmetry in range(8):
        flip, mirror, reverse = _symmetry(symmetry)
        px, py = (x * c + y * s, x * s - y * c) if reverse else (x, y)
        px, py, turn, sine = flip * px, mirror * py, flip * mirror * phi, flip * mirror * s
        # As a word of the flipped pose has it: a metre forward is one in reverse.
        ahead, behind = (1.0, back) if flip > 0.0 else (back, 1.0)
        for right in range(2):
            r, theta = _centre(px, py, sine, c, right)
            first, stop = (_TO_R, _STOP) if right else (_TO_L, _TO_R)
            for word in range(first, first + 1 if reverse else stop):
                t, u, v = _solved(word, r, theta, turn)
                if t == inf:
                    continue
                best = min(best, _cost(_pieces(word, t, u, v), ahead, behind, cusp))
                if word in (_LSL, _LSR) and min(t, v) < -_ZERO:
                    best = min(best, ahead * (_onward(t) + u + _onward(v)))
    return radius * best


@inner
def _symmetry(index: int) -> tuple[float, float, bool]:
    """Whether it is driven in the other direction (-1), mirrored (-1), and from the goal to the start."""
    return (-1.0 if index & 1 else 1.0), (-1.0 if index & 2 else 1.0), index >= 4


@inner
def _centre(x: float, y: float, sine: float, cosine: float, right: int) -> tuple[float, float]:
    """Equation (RS1): r, theta."""
    side = -1.0 if right else 1.0
    ahead, beside = x - side * sine, y - 1.0 + side * cosine
    r = sqrt(ahead * ahead + beside * beside)
    # Where both are the same there is no direction: not that of the rounding.
    return r, (atan2(beside, ahead) if r > _ZERO else 0.0)


@inner
def _solved(word: int, r: float, theta: float, phi: float) -> tuple[float, float, float]:
    """Equations (RS2) to (RS9): t, u, v; t is inf where there are none."""
    none = (inf, 0.0, 0.0)
    if word == _LSL:
        return _wrapped(theta), r, _wrapped(phi - theta)
    if word == _LRL:
        if r > 4.0 + _SAME:
            return none
        u = -2.0 * asin(r / 4.0) if r < 4.0 - _SAME else -pi
        t = theta + 0.5 * u + pi
        return _wrapped(t), u, _wrapped(phi - t + u)
    if word == _LRSR:
        if r < 2.0 - _SAME:
            return none
        t = theta + 0.5 * pi
        return _wrapped(t), 2.0 - r, _wrapped(t + 0.5 * pi - phi)
    if word == _LRLR_OPPOSED:
        cosine = 0.25 * (2.0 + r)
        if cosine > 1.0 + _SAME:
            return none
        u = acos(cosine) if cosine < 1.0 - _SAME else 0.0
        t = theta + u + 0.5 * pi
        return _wrapped(t), u, _wrapped(t - 2.0 * u - phi)
    if word == _LRLR_ALIKE:
        cosine = (20.0 - r * r) / 16.0
        if cosine < 0.0 or cosine > 1.0 + _SAME:
            return none
        u = -acos(cosine) if cosine < 1.0 - _SAME else 0.0
        t = theta + 0.5 * pi + atan2(-sin(u), 2.0 - cos(u))
        return _wrapped(t), u, _wrapped(t - phi)
    # What is left has a straight between turns to different sides.
    square = r * r - 4.0
    if square < -_SAME or (word == _LRSL and square < 4.0) or (word == _LRSLR and square < 16.0):
        return none
    straight = sqrt(square) if square > _SAME else 0.0
    t = theta + atan2(2.0, straight)
    if word == _LSR:
        return _wrapped(t), straight, _wrapped(t - phi)
    t += 0.5 * pi
    if word == _LRSL:
        return _wrapped(t), 2.0 - straight, _wrapped(phi - t - 0.5 * pi)
    return _wrapped(t), 4.0 - straight, _wrapped(t - phi)


@inner
def _pieces(word: int, t: float, u: float, v: float) -> _Lengths:
    if word in (_LSL, _LSR, _LRL):
        return t, u, v, 0.0, 0.0
    if word == _LRLR_OPPOSED:
        return t, u, -u, v, 0.0
    if word == _LRLR_ALIKE:
        return t, u, u, v, 0.0
    if word == _LRSLR:
        return t, -0.5 * pi, u, -0.5 * pi, v
    return t, -0.5 * pi, u, v, 0.0


@inner
def _put(word: int, pieces: _Lengths, symmetry: int, lengths: Array, turns: Array) -> None:
    """Write a word as its symmetry has it: `lengths` and `turns` (PIECES,)."""
    flip, mirror, reverse = _symmetry(symmetry)
    for k, length in enumerate(pieces):
        # In reverse are words of four pieces only.
        at = 3 - k if reverse and k < 4 else k
        lengths[at] = flip * length if abs(length) > _ZERO else 0.0
        turns[at] = mirror * _TURNS[word, k]


@inner
def _cost(pieces: _Lengths, ahead: float, back: float, cusp: float) -> float:
    """Cost of the pieces of a word; all in the same unit of length."""
    cost, before = 0.0, 0.0
    for length in pieces:
        if abs(length) > _ZERO:
            cost += ahead * length if length > 0.0 else -back * length
            if before * length < 0.0:
                cost += cusp
            before = length
    return cost


@inner
def _onward(angle: float) -> float:
    """The same angle in [0, 2 pi), but for what is too short to be a piece."""
    return angle + 2.0 * pi if angle < -_ZERO else angle


@inner
def _wrapped(angle: float) -> float:
    """The same angle in (-pi, pi]: half a turn is positive, however it was rounded."""
    return angle - 2.0 * pi * floor((angle + pi - _ZERO) / (2.0 * pi))

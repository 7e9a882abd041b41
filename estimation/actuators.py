"""Dead time and lag of an actuator, from what was commanded and what is measured.

A bank of models (`estimation.actuator_bank`) is driven by the commands: accelerations or steering rates, and
the set-points of speed or steering that are sent with them, as nobody says which of the two the vehicle
obeys. The likeliest model replaces the present one only if the actuator is seen to answer, if the evidence
against all models near the present one is strong, and if it explains what they leave: noise, a slope, a
frozen sensor or a model that is right change nothing.
"""

from __future__ import annotations

from math import floor, log, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimation.actuator_bank import AT, LAGS, VALUE, Scale, answers, residuals
from estimation.types import Array
from geometry.arrays import locked

STEP: Final = 0.05
DEAD_TIMES: Final = STEP * np.arange(11)
"""Of the bank [s], from the shortest one on by which the present one is in it."""
MEMORY = 6.0
"""Time over which the models are compared [s]: from rest to a steady speed, and a bend or two."""
SPACING = 0.04  # of measurements that are kept [s]: at most 150
GATHERING = 5.0
"""After so long [s] what the comparisons found is gathered, before the start of the ride is out of memory."""
INTERVAL = 0.1
"""Between two comparisons [s] in the first `GATHERING` of a ride; `RARELY` times that later on."""
RARELY = 4.0
STILL = 3.0  # times `Scale.least`: less was neither commanded nor measured in all that counts
AGREEING = 2  # comparisons that have to agree
TOLD = 0.2  # corrections by less than this [s], after a first one, are not told
SUSPICION = 3.0  # in place of `EVIDENCE`: what seems to act beside the commands may be lag
REFINING = 8.0  # in place of `EVIDENCE`, for a model near the one that was corrected to
NEAR = 0.055
"""Models that differ by less in dead time, in lag and in both together [s] are near: nothing in the loop
depends on that."""
EVIDENCE = 20.0
"""Twice the logarithm of the likelihood by which the best model has to be better: noise alone reaches 15."""
KEPT = 0.9
"""Of the evidence of earlier seconds, each `GATHERING`: a brake that is weak once, or a creep torque that is
felt at its end, is no lag after a ride in which there was none."""
EXPLAINS = 25.0
"""Squares that a better model explains, over those that it leaves beyond noise: else something else than lag
is wrong, a slope that changes, say."""
SURE = 1.5  # standard deviations by which a variance of noise may be larger than it is estimated
LEAST_COUNT = 10  # of measurements that are compared


_NO_ROWS: Final = locked(np.empty((0, 3)))
_NO_EVIDENCE: Final = locked(np.zeros((2, len(DEAD_TIMES), len(LAGS))))


class SentCommand(NamedTuple):
    """A command sent at a time [s]: a rate [m/s²] or [rad/s], and a set-point [m/s] or [rad]."""

    at: float
    rate: float
    setpoint: float


class Measurement(NamedTuple):
    """A measurement at a time [s]: speed [m/s] or steering [rad], and the heading [rad] then."""

    at: float
    value: float
    heading: float


class ActuatorRecord(NamedTuple):
    """Commands and measurements of the last seconds, and what the comparisons found.

    Attributes:
        sent: (c, 3) `SentCommand`s, the last one under way; measured: (m, 3) `Measurement`s.
        evidence: (2, dead times, lags) against each model from earlier seconds, in twice the logarithm of the
            likelihood; fresh: the same of the seconds before `gathered_at` [s].
        lags: of the models [s]; first: (3, lags) at the first command, Y of (A1) of rates and of set-points,
            and w of the rates.
        compared_at: when the models were compared last [s]; found: the best model then, or None: the present
            one; agreed: number of comparisons that found it.
        suspected: a better model, with too little evidence to change to it, or None.
        obeys_setpoints: they explain the measurements better than the rates.
        corrected: (dead time, lag) that the present model was corrected to first, or by more than `TOLD` [s]
            last; None: it was not.
    """

    sent: Array = _NO_ROWS
    measured: Array = _NO_ROWS
    lags: Array = LAGS
    first: Array = locked(np.zeros((3, len(LAGS))))
    evidence: Array = _NO_EVIDENCE
    fresh: Array = _NO_EVIDENCE
    gathered_at: float | None = None
    compared_at: float = -np.inf
    found: tuple[float, float] | None = None
    agreed: int = 0
    suspected: tuple[float, float] | None = None
    obeys_setpoints: bool = False
    corrected: tuple[float, float] | None = None

    def restarted(self) -> ActuatorRecord:
        """After a time of which it is not known what was driven."""
        return ActuatorRecord(
            lags=self.lags,
            evidence=self.evidence,
            fresh=self.fresh,
            obeys_setpoints=self.obeys_setpoints,
            corrected=self.corrected,
        )


def record_of(lag: float) -> ActuatorRecord:
    """Of an actuator that is said to have this lag [s]: it is among those of the models, in place of the
    nearest one."""
    lags = LAGS.copy()
    lags[np.abs(LAGS - lag).argmin()] = max(lag, LAGS[0])
    return ActuatorRecord(lags=locked(lags))


def noted(record: ActuatorRecord, command: SentCommand, measurement: Measurement) -> ActuatorRecord:
    """With a command, and what was measured after it; the first one is taken to have gone on like that."""
    sent, measured, first, at = record.sent, record.measured, record.first, measurement.at
    if not len(sent):
        steadily = np.broadcast_arrays(0.0, command.setpoint - command.rate * record.lags, command.rate)
        first = np.stack(steadily)
    elif command.at <= sent[-1, AT]:  # it takes the place of the last one at once
        command, sent = command._replace(at=float(sent[-1, AT])), sent[:-1]
    if not len(measured) or at - measured[-1, AT] >= SPACING - 1e-9:
        since = measured[:, AT].searchsorted(at - MEMORY)
        measured = np.concatenate((measured[since:], (measurement,)))
    return record._replace(sent=np.concatenate((sent, (command,))), measured=measured, first=first)


def is_due(record: ActuatorRecord, now: float) -> bool:
    """Whether the models are to be compared at `now` [s]."""
    if len(record.measured) < LEAST_COUNT:
        return False
    often = record.found is not None or now - record.measured[0, AT] < GATHERING
    return bool(now - record.compared_at + 1e-9 >= (INTERVAL if often else RARELY * INTERVAL))


def compare_models(
    record: ActuatorRecord, at: float, present: tuple[float, float], scale: Scale
) -> tuple[ActuatorRecord, tuple[float, float] | None]:
    """The models compared with the `present` one, (dead time, lag) [s], at `at` [s]; the one to change to, or
    None."""
    values, count = record.measured[:, VALUE], len(record.measured)
    noise, least = _noise_variance(values), (0.3 * scale.least) ** 2
    dead_times, near = _bank(present, record.lags)
    stamps, answered = _answered(record, at)
    gone = int(stamps.searchsorted(stamps[-2] - MEMORY - 1.0))
    stamps, answered = stamps[gone:], answered[gone:]
    record = record._replace(sent=record.sent[gone:], first=answered[0].copy(), compared_at=at)
    moved = max(float(np.ptp(values)), float(np.ptp(answered[:-1, :2, 0], axis=0).max()))
    if moved < STILL * scale.least:
        return record, None
    left, price, alone = residuals(stamps, answered, record.measured, dead_times, noise + least, scale)
    against = count * np.log(left + least) + price
    best = np.unravel_index(int(np.argmin(against)), against.shape)
    kept = np.unravel_index(int(np.argmin(np.where(near, against, np.inf))), against.shape)
    evidence = float(against[kept] - against[best])
    now, then = float(left[kept]), float(left[best])
    model = float(dead_times[best[1]]), float(record.lags[best[2]])
    sure = 1.0 + SURE * sqrt(2.0 / count)
    explains = (
        count * log((alone[best[0]] + least) / (then + least)) > EVIDENCE
        and (now - then > (0.5 * scale.least) ** 2 or record.corrected is not None)
        and now - then > EXPLAINS * max(then - sure * noise, 0.0)
        and best[1] < len(DEAD_TIMES) - 1
        and best[2] < len(record.lags) - 1
    )
    earlier = max(float(record.evidence[best] - record.evidence[:, near].min()), 0.0)
    refines = record.corrected is not None and not _is_news(model, record.corrected)
    better = explains and evidence - earlier > (REFINING if refines else EVIDENCE)
    agrees = better and record.found is not None and abs(sum(model) - sum(record.found)) <= 2.0 * NEAR
    agreed = (record.agreed + 1 if agrees else 1) if better else 0
    changed = model if agreed >= AGREEING else None
    record = _gathered(record, against - against.min(), at)
    record = record._replace(
        found=model if better else None,
        agreed=agreed,
        suspected=model if explains and evidence > SUSPICION and changed is None else None,
        obeys_setpoints=bool(best[0] == 1),
        corrected=changed if changed and _is_news(changed, record.corrected) else record.corrected,
    )
    return record, changed


def _answered(record: ActuatorRecord, at: float) -> tuple[Array, Array]:
    """Times (c,) [s] of the commands and `at`, and the `answers` (c, 3, lags) until then."""
    sent = np.concatenate((record.sent, ((at, 0.0, 0.0),)))
    return sent[:, AT].copy(), answers(sent, record.first, record.lags)


def _is_news(model: tuple[float, float], told: tuple[float, float] | None) -> bool:
    """Whether a model answers so much earlier or later than the one that was told last."""
    return told is None or abs(sum(model) - sum(told)) > TOLD


def _gathered(record: ActuatorRecord, fresh: Array, at: float) -> ActuatorRecord:
    """With the evidence of one more `GATHERING` once it is over: what is still compared counts once."""
    if record.gathered_at is None:
        return record._replace(gathered_at=at)
    if at - record.gathered_at < GATHERING:
        return record
    return record._replace(evidence=KEPT * record.evidence + record.fresh, fresh=fresh, gathered_at=at)


def _bank(present: tuple[float, float], lags: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Dead times of the bank [s], and which of its models (dead times, lags) are near the present one.

    The present dead time and lag are among them: what is right leaves nothing that another one explains.
    """
    beside = max(present[0] - STEP * floor(present[0] / STEP + 1e-6), 0.0)
    dead_times = np.asarray(DEAD_TIMES + beside, dtype=float)
    dead_time, lag = np.abs(dead_times - present[0]), np.abs(lags - present[1])
    total = np.abs(dead_times[:, None] + lags - sum(present))
    each = (dead_time <= max(NEAR, dead_time.min()))[:, None] & (lag <= max(NEAR, lag.min()))
    return dead_times, np.asarray(each & (total <= max(NEAR, total[each].min())))


def _noise_variance(measured: Array) -> float:
    """Variance of the noise of values (n,), by their second differences: motion has hardly any."""
    second = np.diff(measured, 2)
    return float(second @ second) / (6.0 * len(second))


def mean_rate(record: ActuatorRecord, model: tuple[float, float], begin: float, end: float) -> float | None:
    """Mean of w of a model of the bank from `begin` to `end` [s], of rates; None where it is not known."""
    if not len(record.sent) or not begin < end or begin - model[0] < record.sent[0, AT]:
        return None
    stamps, answered = _answered(record, end)
    gained = answered[:, 0, int(np.argmin(np.abs(record.lags - model[1])))]
    from_to = np.interp((begin - model[0], end - model[0]), stamps, gained)
    return float(from_to[1] - from_to[0]) / (end - begin)

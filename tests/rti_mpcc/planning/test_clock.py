"""What time decides in a cycle, kept and played back. No test waits for the clock: it is set."""

from __future__ import annotations

import pytest

from rti_mpcc.config import EXIT
from rti_mpcc.planning import clock as module
from rti_mpcc.planning.clock import TIME_IS_UP, CycleClock, Decisions, PlayedBack
from rti_mpcc.qp.solver import Stop


class Watch:
    """Stands in for `perf_counter`."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Watch:
    watch = Watch()
    monkeypatch.setattr(module, "perf_counter", watch)
    return watch


def test_without_a_deadline_there_is_always_time(watch: Watch) -> None:
    clock = CycleClock()
    watch.now += 1e6
    assert clock.grants()
    assert clock.ends()(400) == ""
    assert not clock.late()
    assert clock.seconds == 1e6


def test_an_iteration_is_granted_if_one_like_the_longest_still_fits(watch: Watch) -> None:
    clock = CycleClock(0.020)
    assert clock.grants()
    watch.now += 0.006
    assert clock.grants()
    watch.now += 0.005
    assert clock.grants()  # 8 ms are left, the longest took 6 ms
    watch.now += 0.003
    assert not clock.grants()
    assert clock.decisions.granted == (True, True, True, False)


def test_a_qp_ends_when_the_time_for_it_is_up(watch: Watch) -> None:
    clock = CycleClock(0.020)
    ends = clock.ends()
    assert ends(0) == ""
    watch.now += 0.020 - 2.0 * EXIT
    assert ends(50) == ""
    watch.now += EXIT
    assert ends(100) == TIME_IS_UP


def test_whether_it_is_too_late_is_decided_once(watch: Watch) -> None:
    clock = CycleClock(0.020)
    watch.now += 0.019
    assert not clock.late()
    watch.now += 0.019
    assert not clock.late()
    assert not clock.decisions.late
    assert CycleClock(0.020).late() is False
    other = CycleClock(0.020)
    watch.now += 0.021
    assert other.late()
    assert other.decisions.late


def test_what_was_decided_is_played_back_without_looking_at_a_clock(watch: Watch) -> None:
    stop = Stop(TIME_IS_UP, 150)
    decisions = Decisions(granted=(True, True, False), stops=(None, stop), late=True)
    clock = PlayedBack(decisions)
    watch.now += 1e9
    assert clock.grants()
    assert clock.ends()(2000) == ""
    clock.took(None)
    assert clock.grants()
    second = clock.ends()
    assert [second(iterations) for iterations in (0, 50, 100, 150)] == ["", "", "", TIME_IS_UP]
    clock.took(stop)
    assert not clock.grants()
    assert clock.late()
    assert clock.decisions == decisions


def test_asked_more_often_than_it_was_it_grants_nothing() -> None:
    clock = PlayedBack(Decisions())
    assert not clock.grants()
    assert clock.ends()(50) == ""
    assert not clock.late()


def test_no_less_than_what_is_asked_for_has_to_be_left(watch: Watch) -> None:
    clock = CycleClock(0.020)
    assert clock.grants(0.015)
    assert not clock.grants(0.025)
    assert clock.decisions.granted == (True, False)

"""Going first where the system permits it; threads that are started then inherit it, and nobody else."""

import os
import threading

import pytest

from groundstation.launch.urgency import go_first, going_first


def policy_in_thread():
    found = []
    thread = threading.Thread(target=lambda: found.append(os.sched_getscheduler(0)))
    thread.start()
    thread.join()
    return found[0]


def test_where_it_is_not_permitted_nothing_changes(monkeypatch):
    def refuse(*_):
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    before = os.sched_getscheduler(0)
    assert go_first() is False
    with going_first() as is_permitted:
        assert is_permitted is False
        assert policy_in_thread() == before


def test_threads_that_are_started_meanwhile_go_first_and_the_caller_is_as_before():
    before = os.sched_getscheduler(0)
    with going_first() as is_permitted:
        if not is_permitted:
            pytest.skip("this user may not")
        assert policy_in_thread() == os.SCHED_RR
    assert os.sched_getscheduler(0) == before
    assert policy_in_thread() == before

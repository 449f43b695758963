"""Ctrl-C while the command is still being loaded."""

import builtins

import pytest

from groundstation.__main__ import INTERRUPTED, main


def test_ctrl_c_while_the_command_is_loaded_is_no_traceback(monkeypatch):
    load = builtins.__import__

    def interrupted(name, *rest):
        if name == "groundstation.cli.main":
            raise KeyboardInterrupt
        return load(name, *rest)

    monkeypatch.setattr(builtins, "__import__", interrupted)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == INTERRUPTED

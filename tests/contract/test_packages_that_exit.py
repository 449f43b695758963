"""Whatever is loaded for somebody else: a package that exits on import is named, and ends nothing."""

from importlib.metadata import EntryPoint

import pytest

from drivers.errors import NotFound
from drivers.laboratory import channels
from firmware_emulator import device_table
from groundstation.cli import extensions
from groundstation.control import controllers
from groundstation.declarations.errors import UsageError
from groundstation.launch import guided
from groundstation.parts import table

LOADERS = {
    "parts": (table, table.installed_tables.__wrapped__, UsageError),
    "controllers": (controllers, controllers.controllers.__wrapped__, controllers.ControllerError),
    "commands": (extensions, lambda: extensions.extension("leaver"), extensions.BrokenCommandError),
    "wizards": (guided, lambda: guided.load_wizard("leaver"), UsageError),
    "laboratories": (channels, lambda: channels.load_laboratory("leaver", {}, 0), NotFound),
    "devices": (device_table, device_table.device_kinds.__wrapped__, NotFound),
}


@pytest.mark.parametrize("name", LOADERS)
def test_a_package_that_exits_while_it_is_imported_is_named(name, tmp_path, monkeypatch):
    module, load, error = LOADERS[name]
    (tmp_path / f"leaver_{name}.py").write_text("import sys\nsys.exit(3)\n")
    monkeypatch.syspath_prepend(tmp_path)
    point = EntryPoint("leaver", f"leaver_{name}:THING", "some.group")
    monkeypatch.setattr(module, "entry_points", lambda group, **more: [point])
    with pytest.raises(error, match=r"leaver.*cannot be loaded"):
        load()

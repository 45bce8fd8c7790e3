"""The table of limits in docs/reference/errors.md says what the settings are."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from veselova.service.api.settings import Settings

ROOT = Path(__file__).parent.parent.parent
PAGE = (ROOT / "docs" / "reference" / "errors.md").read_text()

#: Limits that are no numbers.
HOSTS = {"allowed_hosts"}

#: Numbers whose default is that of the machine.
OF_THE_MACHINE = {"workers", "sweep_workers"}

ROWS = {
    setting: cells
    for line in PAGE.splitlines()
    if len(cells := [cell.strip() for cell in line.strip("|").split("|")]) == 6
    and (setting := cells[1].strip("`")) in Settings.model_fields
}


def test_the_table_has_every_setting_that_limits_something() -> None:
    numbers = {
        name for name, field in Settings.model_fields.items() if field.annotation in (int, float)
    }
    assert set(ROWS) == numbers | HOSTS
    assert len(re.findall("^[|] [^|]* [|] `[a-z_]+` [|]", PAGE, re.MULTILINE)) == len(ROWS)


@pytest.mark.parametrize("name", sorted(ROWS))
def test_the_table_has_its_default_and_unit(name: str) -> None:
    _, _, default, unit, beyond, reason = ROWS[name]
    field = Settings.model_fields[name]
    if name in OF_THE_MACHINE:
        assert default == "auto"
    elif name in HOSTS:
        assert default == field.default
    else:
        assert float(default) == field.default
    assert unit
    assert beyond
    assert reason


def test_the_table_names_no_setting_that_there_is_not() -> None:
    section = PAGE[PAGE.index("## Limits") : PAGE.index("## Settings")]
    named = set(re.findall(r"^\|[^|]*\| `([a-z_]+)` \|", section, re.MULTILINE))
    assert named <= set(Settings.model_fields)
    assert named == set(ROWS)

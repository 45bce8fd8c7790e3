"""What every system refuses, and the sentence that it says."""

from __future__ import annotations

from typing import Any

import pytest

from refusals import GOOD, REFUSED, require_sentence
from veselova import InvalidInput
from veselova.mechanics.systems.catalogue import SYSTEMS, class_of


def test_every_system_is_in_the_table() -> None:
    assert GOOD.keys() == REFUSED.keys() == SYSTEMS.keys()
    for system, fields in GOOD.items():
        class_of(system)(**fields)


@pytest.mark.parametrize(
    ("system", "field", "changes", "words"),
    [(system, *row) for system, rows in REFUSED.items() for row in rows],
)
def test_bad_input_is_refused_by_name(
    system: str, field: str, changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(InvalidInput) as raised:
        class_of(system)(**{**GOOD[system], **changes})
    assert isinstance(raised.value, ValueError)
    assert raised.value.field == field
    require_sentence(str(raised.value), field, words)
    assert len(str(raised.value)) < 250

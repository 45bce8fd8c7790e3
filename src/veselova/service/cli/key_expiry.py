"""When a key ends, as a command line states it."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

from veselova.mechanics.core.errors import InvalidInput, show

__all__ = ["expiry"]

_UNITS = {"h": "hours", "d": "days", "w": "weeks"}

#: Longest life that a number of units may state: about a century.
_LONGEST = timedelta(days=36_525)


def expiry(text: str | None, now: datetime) -> datetime | None:
    """Return the moment that ``90d``, ``12h``, ``4w`` or a date such as ``2030-01-31`` states (its
    beginning in UTC).

    Raises InvalidInput for another text, and for a moment that is not to come.
    """
    if text is None:
        return None
    if form := re.fullmatch(r"([0-9]{1,6})([hdw])", text):
        life = timedelta(**{_UNITS[form[2]]: int(form[1])})
        if timedelta() < life <= _LONGEST:
            return now + life
    elif re.fullmatch(r"[0-9]{4}-[0-9]{2}-[0-9]{2}", text):
        try:
            moment = datetime.fromisoformat(text).replace(tzinfo=UTC)
        except ValueError:  # no such day
            moment = now
        if moment > now:
            return moment
    raise InvalidInput(
        ("--expires",), "a time to come: 90d, 12h, 4w, or a date such as 2030-01-31", show(text)
    )

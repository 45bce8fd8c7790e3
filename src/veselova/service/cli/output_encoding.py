"""Text on streams that cannot encode all of it: transliterated, never a traceback."""

from __future__ import annotations

import codecs
import io
import sys
import unicodedata

__all__ = ["transliterate_output"]

_PLAIN = {
    "−": "-",
    "–": "-",
    "—": "-",
    "…": "...",
    "’": "'",
    "·": "*",
    "×": "x",
    "∮": "int ",
    "λ": "lambda",
}


def transliterate_output() -> None:
    """Let standard output and standard error take any text, whatever their encoding."""
    codecs.register_error("veselova.transliterate", _transliterate)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="veselova.transliterate")


def _transliterate(error: UnicodeError) -> tuple[str, int]:
    """Return what stands for the letters that an encoding lacks, and where the text goes on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_plain, error.object[error.start : error.end])), error.end


def _plain(letter: str) -> str:
    """Return a letter in ASCII: γ as gamma, τ as tau, ₁ as 1, and ? for what has no such name."""
    if letter in _PLAIN:
        return _PLAIN[letter]
    name = unicodedata.name(letter, "").split(" WITH ")[0]
    if name.startswith("GREEK "):
        word = name.split()[-1].lower()
        return word.capitalize() if " CAPITAL " in name else word
    return unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode() or "?"

"""The write-ahead log of SQLite, read before SQLite does.

SQLite takes a log up to the first frame whose checksum is wrong, and says nothing of what follows.
That is right for the end of a log, which a machine lost in the middle of writing. It is wrong for a
log that was damaged afterwards: keys and jobs would be gone without a word. The format is described
at sqlite.org/fileformat2.html#walformat.
"""

from __future__ import annotations

import struct
from pathlib import Path

__all__ = ["wal_is_damaged"]

_HEADER = struct.Struct(">8I")
_FRAME = struct.Struct(">6I")

#: The first number of a log, by the byte order of the words that its checksums are made of.
_MAGIC = {0x377F0682: "<", 0x377F0683: ">"}

#: Bytes of a log that are read: SQLite moves its content into the database whenever it has four
#: megabytes.
_MOST = 64_000_000

_MODULUS = 0xFFFFFFFF


def wal_is_damaged(path: Path) -> bool:
    """Return whether a log was damaged after it was written: its header, or a transaction that
    another one follows.

    An incomplete last transaction is no damage; whether a complete one was there, nothing tells.
    """
    try:
        with path.open("rb") as file:
            content = file.read(_MOST)
    except OSError:  # no log, or none that can be read: SQLite says which
        return False
    if len(content) < _HEADER.size + _FRAME.size or not any(content):
        return False
    magic, _, page, _, *salts, first, second = _HEADER.unpack_from(content)
    order = _MAGIC.get(magic)
    if order is None or page < 512 or _checksum(content[:24], order, (0, 0)) != (first, second):
        return True
    return _has_lost_a_transaction(content, page, order, tuple(salts), (first, second))


def _has_lost_a_transaction(
    content: bytes, page: int, order: str, salts: tuple[int, ...], checksum: tuple[int, int]
) -> bool:
    """Return whether a whole frame follows the end of a transaction that follows a frame which is
    not whole.
    """
    broken = ended = False
    for start in range(_HEADER.size, len(content) - _FRAME.size - page + 1, _FRAME.size + page):
        _, pages, *of_frame, first, second = _FRAME.unpack_from(content, start)
        stated = (first, second)
        body = (
            content[start : start + 8] + content[start + _FRAME.size : start + _FRAME.size + page]
        )
        # A checksum continues that of the frame before, which is read from it: a frame can be
        # judged behind a broken one.
        current = tuple(of_frame) == salts  # frames of the log before have other salts
        whole = current and _checksum(body, order, checksum) == stated
        if whole and ended:
            return True
        broken = broken or not whole
        ended = ended or (broken and current and pages > 0)
        checksum = stated
    return False


def _checksum(content: bytes, order: str, seed: tuple[int, int]) -> tuple[int, int]:
    first, second = seed
    words = struct.unpack(f"{order}{len(content) // 4}I", content)
    for even, odd in zip(words[::2], words[1::2]):
        first = (first + even + second) & _MODULUS
        second = (second + odd + first) & _MODULUS
    return first, second

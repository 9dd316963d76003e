"""JSON values one after another out of streams of any length: from a JSON list, or from JSON lines."""

from __future__ import annotations

import codecs
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from io import BufferedReader
from typing import Any, NoReturn

from graders.errors import UsageError

# Read at once; a pipe that holds less gives less, so that whoever waits for an answer before asking on gets it.
_AT_ONCE = 1 << 20
# One value of a stream may take so many characters; memory stays bounded even if a quotation mark is missing.
_LARGEST_VALUE = 1 << 26
_BLANK = re.compile(r"[ \t\r\n]*")
_AFTER_VALUE = tuple(",] \t\r\n")
_BYTE_ORDER_MARK = codecs.BOM_UTF8


@dataclass(frozen=True)
class Unreadable:
    """In place of a value: why it cannot be had."""

    reason: str


class _Refused(ValueError):
    """A value that Python's parser would take, but not JSON."""


def read_values(stream: BufferedReader, source: str, list_expected: bool) -> Iterator[list[Any]]:
    """Values of a JSON list, or of JSON lines, in batches of about as much as can be read at once.

    A list is what begins with "[". Anything else is JSON lines, unless `list_expected`.

    Raises
    ------
    UsageError
        If the stream cannot be read on; all values before were yielded.
    """
    first = stream.read1(_AT_ONCE).removeprefix(_BYTE_ORDER_MARK)
    while first and not first.strip(b" \t\r\n"):
        first = stream.read1(_AT_ONCE)
    chunks = _chunks(first, stream)
    if first.lstrip(b" \t\r\n").startswith(b"["):
        yield from _ListReader(source, chunks).batches()
    elif list_expected:
        what = "it is empty" if not first else "the first character is no ["
        raise UsageError(f"{source}: not a JSON list of cases: {what}; JSON lines belong into a file ending in .jsonl")
    else:
        yield from _lines(source, chunks)


def _chunks(first: bytes, stream: BufferedReader) -> Iterator[bytes]:
    while first:
        yield first
        first = stream.read1(_AT_ONCE)


# ---------------------------------------------------------------------------------------- one value


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object; a key that it names twice would lose one of its values."""
    result = dict(pairs)
    if len(result) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise _Refused(f"an object names the key {json.dumps(twice)} twice")
    return result


def _constant(name: str) -> NoReturn:
    raise _Refused(f"not JSON: {name} is no JSON number")


def _reason(error: ValueError) -> str:
    """Why the strict decoder refuses what may still be JSON; of the parser itself only one complaint remains."""
    return str(error) if isinstance(error, _Refused) else "a number has too many digits"


_STRICT = json.JSONDecoder(object_pairs_hook=_once, parse_constant=_constant)
# Finds the end of what the strict one refuses.
_LENIENT = json.JSONDecoder(parse_int=float)


# -------------------------------------------------------------------------------------------- lines


def _lines(source: str, chunks: Iterator[bytes]) -> Iterator[list[Any]]:
    """The values of JSON lines; each bad line is one Unreadable, blank lines are nothing."""
    number = 1
    for lines in _whole_lines(source, chunks):
        yield [_line(line, number + index) for index, line in enumerate(lines) if line.strip()]
        number += len(lines)


def _whole_lines(source: str, chunks: Iterator[bytes]) -> Iterator[list[bytes]]:
    begun: list[bytes] = []
    size = 0
    for chunk in chunks:
        whole, newline, rest = chunk.rpartition(b"\n")
        if newline:
            yield b"".join((*begun, whole)).split(b"\n")
            begun, size = [], 0
        begun.append(rest)
        size += len(rest)
        if size > _LARGEST_VALUE:
            raise UsageError(f"{source}: a line is longer than {_LARGEST_VALUE >> 20} MiB")
    yield [b"".join(begun)]


def _line(line: bytes, number: int) -> Any:
    try:
        return _STRICT.decode(line.decode("utf-8"))
    except UnicodeDecodeError as error:
        return Unreadable(f"line {number}, byte {error.start} is not UTF-8")
    except json.JSONDecodeError as error:
        return Unreadable(f"line {number}, column {error.pos + 1}: not JSON: {error.msg}")
    except ValueError as error:
        return Unreadable(f"line {number}: {_reason(error)}")
    except RecursionError:
        return Unreadable(f"line {number}: nested too deeply")


# --------------------------------------------------------------------------------------------- list


class _ListReader:
    """Takes a JSON list apart, of which it never holds more than a piece."""

    def __init__(self, source: str, chunks: Iterator[bytes]) -> None:
        self._source = source
        self._chunks = chunks
        self._decoder = codecs.getincrementaldecoder("utf-8")()
        self._bytes_read = 0
        self._text = ""
        self._position = 0
        self._ended = False
        # Why there is no more text, although the stream has not ended.
        self._fault = ""
        # Lines, characters of the last one, and all characters before `_text`.
        self._line, self._column, self._forgotten = 1, 1, 0

    def batches(self) -> Iterator[list[Any]]:
        """All values; what comes before a fault is yielded before that is raised."""
        batch: list[Any] = []
        begin = 0
        try:
            for value in self._values():
                batch.append(value)
                if self._forgotten + self._position - begin >= _AT_ONCE:
                    yield batch
                    batch, begin = [], self._forgotten + self._position
        except UsageError:
            yield batch
            raise
        yield batch

    def _values(self) -> Iterator[Any]:
        delimiter = self._take("[")
        if self._next() == "]":
            delimiter = self._take("]")
        while delimiter != "]":
            yield self._value()
            delimiter = self._take(",]")
        if self._next():
            raise self._broken(self._position, "something follows the list")

    def _take(self, allowed: str) -> str:
        """Step over the next character that is not blank; it has to be an allowed one."""
        character = self._next()
        if not character:
            raise self._broken(self._position, "the list does not end")
        if character not in allowed:
            raise self._broken(self._position, f"expecting {' or '.join(allowed)}")
        self._position += 1
        return character

    def _next(self) -> str:
        """The next character that is not blank; nothing at the end."""
        while True:
            self._position = _end_of_blank(self._text, self._position)
            if self._position < len(self._text):
                return self._text[self._position]
            if self._ended:
                return ""
            self._read()

    def _value(self) -> Any:
        """The value at the next character that is not blank."""
        self._next()
        found = self._whole_value()
        while found is None:
            self._read()
            found = self._whole_value()
        value, self._position = found
        return value

    def _whole_value(self) -> tuple[Any, int] | None:
        """The next value and where it ends; None if more text must be read to tell."""
        text = self._text
        try:
            value, end = _STRICT.raw_decode(text, self._position)
        except json.JSONDecodeError as error:
            # Only a fault close to the end, or a string without an end, may be mended by more text.
            if not self._ended and (error.pos > len(text) - 16 or error.msg.startswith("Unterminated string")):
                return None
            raise self._broken(error.pos, error.msg) from None
        except ValueError as error:
            value = Unreadable(_reason(error))
            try:
                _, end = _LENIENT.raw_decode(text, self._position)
            except json.JSONDecodeError:
                if not self._ended:
                    return None
                raise self._broken(self._position, "the list does not end") from None
        except RecursionError:
            raise self._broken(self._position, "nested too deeply") from None
        # A number might go on, at most with what is no delimiter yet: 1 in "1.", or in "1e-".
        goes_on = not self._ended and end > len(text) - 16 and text[end : end + 1] not in _AFTER_VALUE
        return None if goes_on else (value, end)

    def _read(self) -> None:
        """Drop what was taken and read on: at least as much as is left, so that a long value is not tried often."""
        self._line, self._column = self._place(self._position)
        self._forgotten += self._position
        pieces = [self._text[self._position :]]
        size, wanted = len(pieces[0]), max(2 * len(pieces[0]), 1)
        self._text, self._position = pieces[0], 0
        if size > _LARGEST_VALUE:
            raise self._broken(0, f"a value is longer than {_LARGEST_VALUE >> 20} MiB")
        while size < wanted and not self._ended:
            pieces.append(self._decoded(next(self._chunks, b"")))
            size += len(pieces[-1])
        self._text = "".join(pieces)

    def _decoded(self, chunk: bytes) -> str:
        """The text of the next chunk; it may end within a character."""
        begun = self._decoder.getstate()[0]
        try:
            text = self._decoder.decode(chunk, final=not chunk)
        except UnicodeDecodeError as error:
            self._fault = f"byte {self._bytes_read - len(begun) + error.start} is not UTF-8"
            self._ended = True
            return (begun + chunk)[: error.start].decode("utf-8")
        self._bytes_read += len(chunk)
        self._ended = not chunk
        return text

    def _place(self, position: int) -> tuple[int, int]:
        """Line and column of a position."""
        lines = self._text.count("\n", 0, position)
        if not lines:
            return self._line, self._column + position
        return self._line + lines, position - self._text.rfind("\n", 0, position)

    def _broken(self, position: int, reason: str) -> UsageError:
        if self._fault and position > len(self._text) - 16:
            return UsageError(f"{self._source}: {self._fault}")
        line, column = self._place(position)
        return UsageError(f"{self._source}: line {line}, column {column}: not JSON: {reason}")


def _end_of_blank(text: str, position: int) -> int:
    """The first position that is not blank."""
    found = _BLANK.match(text, position)
    assert found is not None
    return found.end()

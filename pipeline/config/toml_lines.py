"""Where each key of a TOML text stands: tomllib parses strictly but forgets the lines.

The text has passed tomllib, so this scanner only finds its way: it skips values and notes their lines.
"""

import re

Path = tuple[str | int, ...]

_SPACE = re.compile(r"[ \t]*")
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY = re.compile(r'[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'')
_STRING = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}' + r"|'''.*?'{3,5}" + r'|"(?:[^"\\\n]|\\.)*"' + r"|'[^'\n]*'", re.DOTALL
)
_BARE = re.compile(r"[^,\]}#\n]*")


def key_lines(text: str) -> dict[Path, int]:
    """Line, counted from 1, of every table, key and array element of a valid TOML text."""
    return _Scanner(text).scan()


class _Scanner:
    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[Path, int] = {}
        self.tables: dict[Path, int] = {}  # arrays of tables: index of their last element

    def scan(self) -> dict[Path, int]:
        table: Path = ()
        self._skip(_BLANK)
        while self.at < len(self.text):
            if self.text.startswith("[", self.at):
                table = self._header()
            else:
                self._pair(table)
            self._skip(_BLANK)
        return self.lines

    def _header(self) -> Path:
        brackets = 2 if self.text.startswith("[[", self.at) else 1
        self.at += brackets
        table: Path = ()
        names = self._key()
        for name in names[:-1]:
            table = self._inside((*table, name))
        table = (*table, names[-1])
        if brackets == 2:
            self.tables[table] = self.tables.get(table, -1) + 1
            self.lines.setdefault(table, self._line())
        table = self._inside(table)
        self.lines.setdefault(table, self._line())
        self.at += brackets
        return table

    def _inside(self, table: Path) -> Path:
        return (*table, self.tables[table]) if table in self.tables else table

    def _pair(self, table: Path) -> None:
        for name in self._key():
            table = (*table, name)
            self.lines.setdefault(table, self._line())
        self.at += 1  # the equals sign
        self._skip(_SPACE)
        self._value(table)

    def _key(self) -> list[str]:
        names = []
        while True:
            self._skip(_SPACE)
            names.append(self._take(_KEY).strip("\"'"))
            self._skip(_SPACE)
            if not self.text.startswith(".", self.at):
                return names
            self.at += 1

    def _value(self, path: Path) -> None:
        opening = self.text[self.at]
        if opening in "\"'":
            self._take(_STRING)
        elif opening in "[{":
            self._items(path, opening)
        else:
            self._take(_BARE)

    def _items(self, path: Path, opening: str) -> None:
        self.at += 1
        index = 0
        self._skip(_BLANK)
        while self.text[self.at] not in "]}":
            if opening == "{":
                self._pair(path)
            else:
                self.lines[*path, index] = self._line()
                self._value((*path, index))
                index += 1
            self._skip(_BLANK)
            if self.text[self.at] == ",":
                self.at += 1
                self._skip(_BLANK)
        self.at += 1

    def _take(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self.text, self.at)
        if match is None:
            raise ValueError(f"line {self._line()}: not TOML")
        self.at = match.end()
        return match[0]

    def _skip(self, pattern: re.Pattern[str]) -> None:
        self._take(pattern)

    def _line(self) -> int:
        return self.text.count("\n", 0, self.at) + 1

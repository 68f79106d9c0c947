"""YARP's notation of messages as text: 3, 4.5, word, [word], "some text", (lists), {bytes}."""
from .errors import Error


class Word(str):
    """A word as YARP's vocabulary has them: [ok]. Equal to the same text."""


def dump(value):
    """The text of a value; a dict becomes pairs (name value)."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if value != value or value in (float("inf"), float("-inf")):
            raise Error(f"{value} cannot be sent: a finite number is expected")
        return repr(value)
    if isinstance(value, Word):
        return f"[{value}]"
    if isinstance(value, str):
        quoted = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\r", "\\r")
        return f'"{quoted}"'
    if isinstance(value, dict):
        return "(" + " ".join(f"({dump(str(key))} {dump(item)})" for key, item in value.items()) + ")"
    if hasattr(value, "tolist"):  # numpy
        return dump(value.tolist())
    if isinstance(value, (list, tuple)):
        return "(" + " ".join(dump(item) for item in value) + ")"
    raise Error(f"a {type(value).__name__} cannot be sent")


def parse(line):
    """The values of a line, as a list."""
    values, at = _items(line, 0, None, 0)
    return values


def _items(line, at, end, depth):
    if depth > 32:
        raise Error("lists are nested too deep")
    items = []
    while True:
        while at < len(line) and line[at] in " \t\r\n,":
            at += 1
        if at == len(line):
            if end is None:
                return items, at
            raise Error(f"'{end}' is missing in: {line[:80]}")
        char = line[at]
        if char == end:
            return items, at + 1
        if char == "(":
            inner, at = _items(line, at + 1, ")", depth + 1)
            items.append(inner)
        elif char == "[":
            stop = line.find("]", at)
            if stop < 0:
                raise Error(f"']' is missing in: {line[:80]}")
            items.append(Word(line[at + 1:stop]))
            at = stop + 1
        elif char == "{":
            inner, at = _items(line, at + 1, "}", depth + 1)
            if not all(isinstance(one, int) and 0 <= one < 256 for one in inner):
                raise Error(f"bytes are numbers from 0 to 255, not {inner}")
            items.append(bytes(inner))
        elif char == '"':
            text, at = _quoted(line, at + 1)
            items.append(text)
        else:
            stop = at
            while stop < len(line) and line[stop] not in " \t\r\n,()[]{}\"":
                stop += 1
            if stop == at:
                raise Error(f"'{char}' is not expected in: {line[:80]}")
            items.append(_bare(line[at:stop]))
            at = stop


def _quoted(line, at):
    text = []
    while at < len(line):
        char = line[at]
        if char == '"':
            return "".join(text), at + 1
        if char == "\\" and at + 1 < len(line):
            at += 1
            char = {"n": "\n", "r": "\r", "0": "\0"}.get(line[at], line[at])
        text.append(char)
        at += 1
    raise Error(f"a quote does not end in: {line[:80]}")


def _bare(word):
    if word in ("true", "false"):
        return word == "true"
    try:
        return int(word, 0) if word[-1].isdigit() or word[:2].lower() == "0x" else float(word)
    except ValueError:
        pass
    try:
        return float(word)
    except ValueError:
        return word


def named(value):
    """Pairs (name value) as a dict, everywhere in a value; anything else stays."""
    if not isinstance(value, list):
        return value
    if value and all(isinstance(one, list) and len(one) == 2 and isinstance(one[0], str) for one in value):
        return {str(name): named(item) for name, item in value}
    return [named(one) for one in value]

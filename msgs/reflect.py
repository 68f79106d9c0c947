#!/usr/bin/env python3
"""Writes nido/msgs/reflection.h: visit_fields(message, visitor) for every struct of our IDL files.

usage: reflect.py OUTPUT IDL...
The subset of IDL that is understood: nested modules, structs, fields of basic type, string, struct, sequence<T>, T name[N].
"""
import re
import sys

TOKEN = re.compile(r"::|[A-Za-z_]\w*|\d+|[{};<>\[\],]")


def tokens_of(path):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", text, flags=re.S)
    text = re.sub(r"^\s*#[^\n]*", " ", text, flags=re.M)
    return TOKEN.findall(text)


def structs_of(path):
    """Yields (C++ name, [field names]) in the order of the file."""
    tokens = tokens_of(path)
    modules, at = [], 0
    while at < len(tokens):
        word = tokens[at]
        if word == "module":
            modules.append(tokens[at + 1])
            at += 3
        elif word == "struct":
            name, at, fields = tokens[at + 1], at + 3, []
            while tokens[at] != "}":
                end = tokens.index(";", at)
                field = tokens[at:end]
                if field[-1] == "]":
                    field = field[: field.index("[", len(field) - 3)]
                if not re.match(r"[A-Za-z_]", field[-1]) or "," in field:
                    sys.exit(f"{path}: struct {name}: field not understood: {' '.join(field)}")
                # a leading underscore escapes a keyword of IDL and is no part of the name
                fields.append(field[-1].removeprefix("_"))
                at = end + 1
            yield "::".join(modules + [name]), fields
            at += 2
        elif word == "}":
            modules.pop()
            at += 2
        else:
            sys.exit(f"{path}: not understood: {word}")


def main():
    output, inputs = sys.argv[1], sys.argv[2:]
    lines = ["#pragma once", "", "// Written by msgs/reflect.py from msgs/idl. Do not edit.", "",
             '#include "nido/msgs/types.h"', "", "namespace nido::msgs {", ""]
    names = []
    for path in inputs:
        for name, fields in structs_of(path):
            names.append(name)
            for const in ("const ", ""):
                lines.append("template <class Visitor>")
                lines.append(f"void visit_fields({const}{name}& message, Visitor&& visit) {{")
                lines += [f'  visit("{field}", message.{field}());' for field in fields]
                lines.append("}")
    lines += ["", "}  // namespace nido::msgs", ""]
    with open(output, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


if __name__ == "__main__":
    main()

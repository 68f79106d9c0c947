#!/usr/bin/env python3
"""Writes the header with which nido's ports carry the messages of an IDL file (cmake/NidoMessages.cmake).

usage: message_support.py OUTPUT IDL FOLDER...
FOLDERs are searched for the files that the IDL includes.
"""
import os
import re
import sys

from idl_text import texts_of
from reflect import structs_of

INCLUDE = re.compile(r'^\s*#\s*include\s+["<]([^">]+)[">].*$', re.M)


def with_includes(path, folders):
    """The file and those that it includes, these first, each once."""
    with open(path, encoding="utf-8") as file:
        names = INCLUDE.findall(file.read())
    paths = []
    for name in names:
        found = [os.path.join(folder, name) for folder in [os.path.dirname(path), *folders]]
        found = [inner for inner in found if os.path.exists(inner)]
        if not found:
            sys.exit(f"{path}: includes {name}, which is in none of {', '.join(folders)}")
        paths += [inner for inner in with_includes(found[0], folders) if inner not in paths]
    return paths + [path]


def main():
    output, path, folders = sys.argv[1], sys.argv[2], sys.argv[3:]
    name = os.path.splitext(os.path.basename(path))[0]
    structs = [scoped for scoped, _ in structs_of(path)]
    wrong = [scoped for scoped in structs if not re.fullmatch(r"\w+::(msg|srv)::dds_::\w+_", scoped)]
    if wrong:
        sys.exit(f"{path}: struct {wrong[0]} is not named as ROS 2 names messages on the wire; "
                 "expected: module PACKAGE { module msg { module dds_ { struct NAME_ { ... }; }; }; };")
    texts = texts_of(with_includes(path, folders))
    lines = ["#pragma once", "", f"// Written by message_support.py from {os.path.basename(path)}. Do not edit.", "",
             f'#include "{name}.h"', f'#include "{name}PubSubTypes.h"', '#include "nido/msgs/type_support.h"', "",
             "namespace nido::msgs {", ""]
    for scoped in structs:
        package, folder, _, struct = scoped.split("::")
        text = texts[f"{package}/{folder}/{struct[:-1]}"]
        lines += ["template <>", f"struct TypeSupportOf<{scoped}> {{", f"  using type = {scoped}PubSubType;",
                  f'  static constexpr const char* idl = R"idl({text})idl";', "};"]
    lines += ["", "}  // namespace nido::msgs", ""]
    with open(output, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


if __name__ == "__main__":
    main()

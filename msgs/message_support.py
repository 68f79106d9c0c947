#!/usr/bin/env python3
"""Writes the header with which nido's ports carry the messages of an IDL file (cmake/NidoMessages.cmake).

usage: message_support.py OUTPUT IDL FOLDER...
FOLDERs are searched for the files that the IDL includes.
"""
import os
import re
import sys

from reflect import structs_of

INCLUDE = re.compile(r'^\s*#\s*include\s+["<]([^">]+)[">].*$', re.M)


def with_includes(path, folders, seen):
    """The text of a file with that of the files that it includes in front, each once."""
    if path in seen:
        return ""
    seen.add(path)
    with open(path, encoding="utf-8") as file:
        text = file.read()
    before = ""
    for name in INCLUDE.findall(text):
        for folder in [os.path.dirname(path), *folders]:
            inner = os.path.join(folder, name)
            if os.path.exists(inner):
                before += with_includes(inner, folders, seen)
                break
        else:
            sys.exit(f"{path}: includes {name}, which is in none of {', '.join(folders)}")
    return before + INCLUDE.sub("", text)


def main():
    output, path, folders = sys.argv[1], sys.argv[2], sys.argv[3:]
    name = os.path.splitext(os.path.basename(path))[0]
    structs = [scoped for scoped, _ in structs_of(path)]
    wrong = [scoped for scoped in structs if not re.fullmatch(r"\w+::(msg|srv)::dds_::\w+_", scoped)]
    if wrong:
        sys.exit(f"{path}: struct {wrong[0]} is not named as ROS 2 names messages on the wire; "
                 "expected: module PACKAGE { module msg { module dds_ { struct NAME_ { ... }; }; }; };")
    text = with_includes(path, folders, set())
    lines = ["#pragma once", "", f"// Written by message_support.py from {os.path.basename(path)}. Do not edit.", "",
             f'#include "{name}.h"', f'#include "{name}PubSubTypes.h"', '#include "nido/msgs/type_support.h"', "",
             "namespace nido::msgs {", "", "namespace detail {",
             f'inline constexpr char k_{name}_idl[] = R"idl({text})idl";', "}  // namespace detail", ""]
    for scoped in structs:
        lines += ["template <>", f"struct TypeSupportOf<{scoped}> {{", f"  using type = {scoped}PubSubType;",
                  f"  static constexpr const char* idl = detail::k_{name}_idl;", "};"]
    lines += ["", "}  // namespace nido::msgs", ""]
    with open(output, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


if __name__ == "__main__":
    main()

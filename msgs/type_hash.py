#!/usr/bin/env python3
"""Writes a C++ table of the ROS 2 type hash (RIHS01, REP 2016) of every message type of our IDL files.

usage: type_hash.py OUTPUT IDL...
The hash is the SHA-256 of the type's description as JSON: its fields and those of all types that it is made of. A ROS 2 program
of Iron or later looks for it in the user data of an endpoint and tells when two ends disagree.
"""
import hashlib
import json
import sys

from reflect import tokens_of

# type_description_interfaces/msg/FieldType; our IDL says octet for uint8
BASIC = {"octet": 3, "short": 4, "unsigned short": 5, "long": 6, "unsigned long": 7, "long long": 8, "unsigned long long": 9,
         "float": 10, "double": 11, "boolean": 15, "string": 17}
NESTED, ARRAY, UNBOUNDED_SEQUENCE = 1, 48, 144


def ros_name(scoped):
    package, folder, dds, struct = scoped.split("::")
    if dds != "dds_" or not struct.endswith("_"):
        sys.exit(f"{scoped} is not named as ROS 2 names it")
    return f"{package}/{folder}/{struct[:-1]}"


def field_of(words):
    """The description of one field from its tokens."""
    array = 0
    if words[-1] == "]":
        array = int(words[-2])
        words = words[:-3]
    name, kind = words[-1].removeprefix("_"), words[:-1]
    sequence = kind[0] == "sequence"
    if sequence:
        kind = kind[2:-1]
    if "::" in kind:
        type_id, nested = NESTED, ros_name("".join(kind))
    else:
        type_id, nested = BASIC[" ".join(kind)], ""
    type_id += ARRAY if array else UNBOUNDED_SEQUENCE if sequence else 0
    return {"name": name,
            "type": {"type_id": type_id, "capacity": array, "string_capacity": 0, "nested_type_name": nested}}


def types_of(path):
    """Yields the description of each struct, without those that it refers to."""
    tokens = tokens_of(path)
    modules, at = [], 0
    while at < len(tokens):
        if tokens[at] == "module":
            modules.append(tokens[at + 1])
            at += 3
        elif tokens[at] == "struct":
            name, at, fields = "::".join(modules + [tokens[at + 1]]), at + 3, []
            while tokens[at] != "}":
                end = tokens.index(";", at)
                fields.append(field_of(tokens[at:end]))
                at = end + 1
            yield {"type_name": ros_name(name), "fields": fields}
            at += 2
        else:
            modules.pop()
            at += 2


def hash_of(name, types):
    referenced, left = set(), [name]
    while left:
        for field in types[left.pop()]["fields"]:
            nested = field["type"]["nested_type_name"]
            if nested and nested not in referenced:
                referenced.add(nested)
                left.append(nested)
    description = {"type_description": types[name],
                   "referenced_type_descriptions": [types[one] for one in sorted(referenced)]}
    return "RIHS01_" + hashlib.sha256(json.dumps(description).encode()).hexdigest()


def main():
    output, inputs = sys.argv[1], sys.argv[2:]
    types = {one["type_name"]: one for path in inputs for one in types_of(path)}
    lines = ["// Written by msgs/type_hash.py from msgs/idl. Do not edit.", "constexpr TypeHash kTypeHashes[] = {"]
    for name in types:
        package, folder, struct = name.split("/")
        if folder == "msg":  # a service's hash describes both of its messages at once
            lines.append(f'    {{"{package}::{folder}::dds_::{struct}_",\n     "{hash_of(name, types)}"}},')
    lines += ["};", ""]
    with open(output, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


if __name__ == "__main__":
    main()

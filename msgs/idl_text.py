#!/usr/bin/env python3
"""Writes a C++ table of the IDL text of every struct, with the structs that it is made of in front.

usage: idl_text.py OUTPUT IDL...
The text is that of the IDL files, comments and all, with the names that ROS 2 users know: sensor_msgs::msg::Image instead of
sensor_msgs::msg::dds_::Image_.
"""
import re
import sys

TOKEN = re.compile(r"//[^\n]*|/\*.*?\*/|#[^\n]*|module\s+\w+\s*\{|struct\s+\w+\s*\{|\}\s*;", re.S)
REFERENCE = re.compile(r"\b(\w+)::(msg|srv)::dds_::(\w+)_\b")


def structs_of(path):
    """Yields (name as package/folder/Type, text between the braces) in the order of the file."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    modules, begin = [], 0
    for match in TOKEN.finditer(text):
        words = match.group().replace("{", " ").split()
        if words[0] == "module":
            modules.append(words[1])
        elif words[0] == "struct":
            modules.append(words[1])
            begin = match.end()
        elif words[0].startswith("}"):
            name = modules.pop()
            if begin:
                if modules[2:] != ["dds_"] or not name.endswith("_"):
                    sys.exit(f"{path}: struct {name} is not named as ROS 2 names it")
                yield f"{modules[0]}/{modules[1]}/{name[:-1]}", text[begin:match.start()]
                begin = 0


def texts_of(paths):
    """{package/folder/Type: its text, with the structs that it is made of in front}, of all structs of the files."""
    bodies = {}
    for path in paths:
        bodies.update(structs_of(path))

    def needed_by(name):
        """The struct and those that it is made of, these first."""
        order = []
        for match in REFERENCE.finditer(bodies[name]):
            order += [one for one in needed_by("/".join(match.groups())) if one not in order]
        return order + [name]

    def definition_of(name):
        package, folder, struct = name.split("/")
        body = REFERENCE.sub(r"\1::\2::\3", bodies[name])
        lines = [line.strip() for line in body.strip().split("\n")]
        inner = "\n".join("      " + line if line else "" for line in lines)
        return f"module {package} {{\n  module {folder} {{\n    struct {struct} {{\n{inner}\n    }};\n  }};\n}};\n"

    return {name: "\n".join(definition_of(one) for one in needed_by(name)) for name in bodies}


def main():
    output, inputs = sys.argv[1], sys.argv[2:]
    lines = ["// Written by msgs/idl_text.py from msgs/idl. Do not edit.", "constexpr IdlText kIdlTexts[] = {"]
    for name, text in texts_of(inputs).items():
        lines.append(f'    {{"{name}", R"idl({text})idl"}},')
    lines += ["};", ""]
    with open(output, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Runs the contract suites and writes which interface holds on which backend as a table.

    scripts/contract_table.py build > docs/contracts.md

Tests are counted as they ran: passed/all; skipped ones are not passed. A suite that a program does not have is an empty cell.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

PROGRAMS = ["test_robot_devices", "test_robot_tasks", "test_simulated_devices", "test_wrappers", "test_joined",
            "test_gateway"]


def results_of(program):
    """{(backend, interface): [passed, all, skipped]} of one test program."""
    with tempfile.NamedTemporaryFile(suffix=".json") as file:
        subprocess.run([program, "--gtest_filter=*Contract*", f"--gtest_output=json:{file.name}"],
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        report = json.loads(pathlib.Path(file.name).read_text() or "{}")
    counts = {}
    for suite in report.get("testsuites", []):
        backend, _, interface = suite["name"].partition("/")
        if not interface.endswith("Contract"):
            continue
        count = counts.setdefault((backend, interface.removesuffix("Contract")), [0, 0, 0])
        for test in suite["testsuite"]:
            if test["status"] != "RUN":
                continue
            count[1] += 1
            count[2] += test.get("result") == "SKIPPED"
            count[0] += test.get("result") != "SKIPPED" and "failures" not in test
    return counts


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build") / "bin"
    counts = {}
    for program in PROGRAMS:
        path = folder / program
        if not path.exists():
            sys.exit(f"{path} is not there: build it first")
        counts.update(results_of(path))
    interfaces = sorted({interface for _, interface in counts})
    backends = sorted({backend for backend, _ in counts})
    print("# Contracts: interface by backend\n")
    print("Each cell: tests passed / run. Written by `scripts/contract_table.py build`; docs/devices.md tells what a contract is.\n")
    print("| backend | " + " | ".join(interfaces) + " |")
    print("|---" * (len(interfaces) + 1) + "|")
    for backend in backends:
        cells = [counts.get((backend, interface)) for interface in interfaces]
        print(f"| {backend} | " + " | ".join(f"{c[0]} / {c[1]}" if c else "" for c in cells) + " |")
    skipped = {backend: sum(c[2] for (b, _), c in counts.items() if b == backend) for backend in backends}
    for backend, number in skipped.items():
        if number:
            print(f"\n{number} tests are skipped on {backend}: a streamed command and an order travel on connections of"
                  " their own\nthere, so which comes first is no promise (docs/yarp.md).")
    if any(passed + left_out < run for passed, run, left_out in counts.values()):
        sys.exit(1)


if __name__ == "__main__":
    main()

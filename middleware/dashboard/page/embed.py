"""usage: embed.py OUT INDEX STYLE SCRIPT: one page of three files, as pieces of C++ text."""
import sys

out, index, style, script = sys.argv[1:]
page = open(index, encoding="utf-8").read()
page = page.replace("@STYLE@", open(style, encoding="utf-8").read())
page = page.replace("@SCRIPT@", open(script, encoding="utf-8").read())
assert ')page"' not in page
with open(out, "w", encoding="utf-8") as file:
    # compilers need not take longer pieces
    for begin in range(0, len(page), 8000):
        file.write('R"page(' + page[begin:begin + 8000] + ')page",\n')

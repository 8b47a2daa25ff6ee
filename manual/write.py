"""Writes manual pages and completions.

usage: write.py program DESCRIPTION PAGES DATA MAN BASH ZSH FISH   of a program, as it describes itself (describe.h)
       write.py config TEXT NAME PAGES DATA MAN                    of a configuration file, as --print-config prints it
DATA is the directory of what is installed with the programs; MAN, BASH, ZSH and FISH are files to be written.
"""

import pathlib
import sys
import tomllib

import bash
import fish
import mdoc
import table
import zsh


def read(pages, data):
    return tomllib.loads(pathlib.Path(pages).read_text().replace("@DATA@", data))


def program(description, pages, data, man, *completions):
    described = table.load(pathlib.Path(description))
    pathlib.Path(man).write_text(mdoc.page(described, read(pages, data)[described.path[0]]))
    for shell, file in zip((bash, zsh, fish), completions):
        pathlib.Path(file).write_text(shell.completion(described))


def config(text, name, pages, data, man):
    pathlib.Path(man).write_text(mdoc.config_page(name, pathlib.Path(text).read_text(), read(pages, data)[name]))


if __name__ == "__main__":
    {"program": program, "config": config}[sys.argv[1]](*sys.argv[2:])

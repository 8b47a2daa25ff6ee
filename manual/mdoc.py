"""Manual pages in mdoc(7)."""

import os
import re
import textwrap
import time


def literal(text):
    """A word as the argument of a macro."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace('"', "\\(dq")
    if re.fullmatch(r"[A-Za-z]{2,3}|[.,:;()\[\]?!|]", text):
        text = "\\&" + text  # which else is a macro or punctuation
    return f'"{text}"' if " " in text else text


def prose(text):
    """Lines of text, a sentence on a line of its own."""
    lines = []
    for sentence in re.split(r"(?<=\w[.!?:]|[)\]][.!?:]) +(?=[A-Z])|\n+", text):
        for line in textwrap.wrap(sentence, 78, break_long_words=False, break_on_hyphens=False):
            line = re.sub(r"(?<!\w)-[\w-]+", lambda word: word[0].replace("-", "\\-"), line.replace("\\", "\\e"))
            lines.append("\\&" + line if line[0] in ".'" else line)
    return "\n".join(lines)


def header(name, section):
    date = time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", time.time())))
    return [f".Dd {time.strftime('%B', date)} {date.tm_mday}, {date.tm_year}", f".Dt {name.upper()} {section}",
            ".Os"]


def lower(text):
    """A description behind a name: no capital, no point at the end."""
    return text[0].lower() + text[1:].rstrip(".")


def synopsis(option):
    """As one macro line: .Op Fl -json"""
    words = []
    if option.names:
        words.append(f"Fl {literal(option.names[-1][1:])}")
    if option.value:
        words.append(f"Ar {literal(option.value)}" + (" ..." if option.many else ""))
    return ("." if option.required else ".Op ") + " ".join(words)


def item(option):
    """Of a list: the name, and what is to be known of it."""
    value = f" Ar {literal(option.value)}" + (" ..." if option.many else "") if option.value else ""
    names = " , ".join(f"Fl {literal(name[1:])}" for name in option.names)
    yield f".It {names}{value}" if names else f".It{value}"
    yield prose(option.help[0].upper() + option.help[1:] + ("" if option.help[-1] in ".!?" else "."))
    if option.choices:
        yield prose("One of " + ", ".join(option.choices) + ".")
    if option.limits:
        yield prose(f"From {option.limits}.")
    if option.default:
        yield prose(f"Default: {option.default}.")
    if option.excludes:
        yield prose("Not together with " + ", ".join(option.excludes) + ".")


def table(entries):
    """A list with tags. \\param entries each as its lines, .It first"""
    yield ".Bl -tag -width Ds"
    for entry in entries:
        yield from entry
    yield ".El"


def usage(command):
    """The name and what follows it, in lines."""
    yield ".Nm"
    if len(command.path) > 1:
        yield ".Cm " + " ".join(literal(word) for word in command.path[1:])
    for option in command.options:
        if not {"--help", "--version"} & set(option.names):
            yield synopsis(option)
    for operand in command.operands:
        yield synopsis(operand)
    if command.commands:
        yield ".Op Ar COMMAND"


def options(command):
    listed = [*command.operands, *(one for one in command.options
                                   if len(command.path) == 1 or "--help" not in one.names)]
    if listed:
        yield from table(item(one) for one in listed)


def page(program, extra):
    """The manual page of a program. \\param extra of pages.toml, what no table holds"""
    name = program.path[0]
    lines = [*header(name, extra["section"]), ".Sh NAME", f".Nm {name}", f".Nd {lower(program.help)}",
             ".Sh SYNOPSIS", *usage(program), ".Sh DESCRIPTION"]
    lines += ["\n.Pp\n".join(prose(text) for text in extra["about"]), *options(program)]
    if program.footer:
        lines += [".Pp", prose(program.footer)]
    commands = [one for one in program.all() if len(one.path) > 1]
    if commands:
        anywhere = "Options of the program may stand before or behind a command."
        lines += [".Sh COMMANDS", *([anywhere] if commands[0].inherited else [])]
    for command in commands:
        lines += [".Ss " + " ".join(literal(word) for word in command.path[1:]), *usage(command), ".Pp",
                  prose(command.help.rstrip(".") + "."), *options(command)]
        if command.footer:
            lines += [".Pp", prose(command.footer)]
    for title, macro, key in (("ENVIRONMENT", "Ev", "environment"), ("FILES", "Pa", "files")):
        if key in extra:
            lines += [f".Sh {title}", *table([f".It {macro} {literal(one)}", prose(what)] for one, what in extra[key])]
    if program.exits:
        lines += [".Sh EXIT STATUS", *table([f".It {code}", prose(what[0].upper() + what[1:] + ".")]
                                            for code, what in program.exits)]
    lines += [".Sh EXAMPLES"]
    for i, (what, words) in enumerate(extra["examples"]):
        lines += [".Pp"] if i else []
        lines += [prose(what), f".Dl {literal(words)}"]
    lines += see_also(extra["see_also"])
    return "\n".join(lines) + "\n"


def see_also(pages):
    by_section = sorted(pages, key=lambda page: page.split()[::-1])
    return [".Sh SEE ALSO", *(f".Xr {one} ," for one in by_section[:-1]), f".Xr {by_section[-1]}"]


def config_page(name, text, extra):
    """The manual page of a configuration file. \\param text with every key, as --print-config prints it"""
    introduction, *sections = re.split(r"^\[(\w+)\]$", text, flags=re.M)
    lines = [*header(name, 5), ".Sh NAME", f".Nm {name}", f".Nd {extra['what']}", ".Sh DESCRIPTION",
             prose(uncommented(introduction)), ".Pp", "\n.Pp\n".join(prose(text) for text in extra["about"])]
    lines += [".Sh KEYS"]
    for section, body in zip(sections[::2], sections[1::2]):
        lines += [f".Ss {literal(section)}", *table(keys(body))]
    lines += [".Sh FILES", *table([f".It Pa {literal(one)}", prose(what)] for one, what in extra["files"])]
    lines += see_also(extra["see_also"])
    return "\n".join(lines) + "\n"


def uncommented(text):
    return re.sub(r"^# ?", "", text, flags=re.M).strip()


def keys(section):
    """Of each key its lines: comments, NAME = VALUE  # what it may be."""
    for block in section.strip().split("\n\n"):
        *comments, last = block.split("\n")
        found = re.fullmatch(r"#?(\w+) = .*  # (.*)", last)
        about = uncommented("\n".join(comments))
        plain, start, example = about.partition(f"\n{found[1]} = ")
        lines = [f".It Cm {literal(found[1])}", prose(plain)]
        if example:
            lines += [".Bd -literal -offset indent", start.strip("\n") + example.replace("\\", "\\e"), ".Ed"]
        limits, *reload = found[2].split("; reload")
        when = "; taken over by a reload" if reload else ""
        yield [*lines, prose(limits[0].upper() + limits[1:] + when + ".")]

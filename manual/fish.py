"""Completion for fish."""

import table

SCRIPT = r"""# fish completion for NAME; made of the table that its --help prints
function __FUNCTION_at  # COMMAND: is it the one that has been typed?
    set -l command NAME
    set -l before ''
    set -l typed (commandline -opc)
    for word in $typed[2..]
        if not contains -- $before VALUED; and contains -- "$command $word" COMMANDS
            set command "$command $word"
        end
        set before $word
    end
    test "$command" = "$argv"
end
complete -c NAME -f
LINES
"""
INSTANCES = ("(begin; echo default; for path in /etc/tractiond/*.toml {/run,$XDG_RUNTIME_DIR}/tractiond/*; "
             "basename $path .toml; end; end | sort -u)")
SCENARIOS = "(traction-twin --help 2>/dev/null | sed -n 's/^Shipped scenarios: //p' | string split ', ')"
ACTIONS = {"FILE": ["-F"], "DIR": ["-a", "(__fish_complete_directories)"], "INSTANCE": ["-a", INSTANCES],
           "SCENARIO": ["-F", "-a", SCENARIOS]}


def quoted(text):
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def action(option):
    return ["-a", " ".join(option.choices)] if option.choices else ACTIONS.get(option.kind, [])


def completion(program):
    lines = []

    def add(command, *words):
        here = ["complete", "-c", program.name, "-n", f"__FUNCTION_at {command.name}", *words]
        lines.append(" ".join(word if word.replace("-", "").isalnum() else quoted(word) for word in here))

    for command in program.all():
        for one in command.commands:
            add(command, "-a", one.path[-1], "-d", one.help)
        for option in command.known:
            names = [word for name in option.names for word in ("-l" if name[1] == "-" else "-s", name.strip("-"))]
            value = ["-r" if "-F" in action(option) else "-x", *action(option)] if option.value else []
            add(command, *names, *value, "-d", option.help)
        for operand in command.operands:
            if action(operand):
                add(command, *action(operand), "-d", operand.help)
    commands = " ".join(quoted(command.name) for command in program.all())
    return (SCRIPT.replace("VALUED", " ".join(table.with_values(program))).replace("COMMANDS", commands)
            .replace("LINES", "\n".join(lines)).replace("FUNCTION", program.name.replace("-", "_"))
            .replace("NAME", program.name))

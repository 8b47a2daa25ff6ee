"""Completion for zsh."""

import table

SCRIPT = r"""#compdef NAME
# zsh completion for NAME; made of the table that its --help prints
FUNCTION_instances() {
  compadd -- ${(u)=:-default /etc/tractiond/*.toml(N:t:r) {/run,$XDG_RUNTIME_DIR}/tractiond/*(N:t)}
}
FUNCTION_scenarios() {
  compadd -- ${(s:, :)"$(traction-twin --help 2>/dev/null | sed -n 's/^Shipped scenarios: //p')"}
  _files
}
FUNCTION() {
  local command=NAME state line
  local -a known=(COMMANDS) valued=(VALUED) commands
  local -i i at=1
  typeset -A opt_args
  for (( i = 2; i < CURRENT; ++i )); do
    if (( ! ${valued[(Ie)$words[i-1]]} && ${known[(Ie)$command $words[i]]} )); then
      command+=" $words[i]"; at=i
    fi
  done
  shift $((at - 1)) words
  (( CURRENT -= at - 1 ))
  case $command in
CASES
  esac
  [[ $state != command ]] || _describe command commands
}
FUNCTION "$@"
"""
ACTIONS = {"FILE": "_files", "DIR": "_files -/", "INSTANCE": "FUNCTION_instances", "SCENARIO": "FUNCTION_scenarios"}


def quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


def plain(text):
    """Without a meaning for _arguments and _describe."""
    for letter in "\\[]:":
        text = text.replace(letter, "\\" + letter)
    return text


def action(option):
    return f"({' '.join(option.choices)})" if option.choices else ACTIONS.get(option.kind, " ")


def argument(option):
    value = f":{plain(option.value)}:{action(option)}" if option.value else ""
    if not option.names:
        return quoted(("*" if option.many else "") + value)
    names = f"({' '.join(option.names)})" if len(option.names) > 1 else "*" if option.many else ""
    words = "{" + ",".join(option.names) + "}" if len(option.names) > 1 else option.names[0] + ("=" if value else "")
    return (quoted(names) if names else "") + words + quoted(f"[{plain(option.help)}]{value}")


def completion(program):
    cases = []
    for command in program.all():
        below = [quoted(f"{one.path[-1]}:{plain(one.help)}") for one in command.commands]
        arguments = [argument(one) for one in (*command.known, *command.operands)]
        if below:
            cases.append(f"  {quoted(command.name)}) commands=({' '.join(below)})")
            arguments += ["'1: :->command'", "'*: :'"]
        else:
            cases.append(f"  {quoted(command.name)})")
        cases.append("    _arguments -C " + " ".join(arguments) + " ;;")
    return (SCRIPT.replace("COMMANDS", " ".join(quoted(command.name) for command in program.all()))
            .replace("VALUED", " ".join(table.with_values(program))).replace("CASES", "\n".join(cases))
            .replace("FUNCTION", "_" + program.name).replace("NAME", program.name))

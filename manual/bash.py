"""Completion for bash."""

import shlex

# What values are, where they are more than words of a table; what else has a value is free.
KINDS = {"FILE": "file", "DIR": "directory", "INSTANCE": "instance", "SCENARIO": "scenario"}

SCRIPT = r"""# bash completion for NAME; made of the table that its --help prints
FUNCTION_table() {  # of the command: what may come behind it; of the option, if there is one: what its value is
  case $command in
COMMANDS
  esac
  case "$command $option" in
VALUES
  *) value= ;;
  esac
}

FUNCTION_values() {  # WORD... | @KIND
  case $1 in
  @file) compgen -f -- "$current" ;;
  @directory) compgen -d -- "$current" ;;
  @instance)
    local path names=default
    for path in /etc/tractiond/*.toml {/run,"$XDG_RUNTIME_DIR"}/tractiond/*; do
      [ ! -e "$path" ] || names+=" $(basename "$path" .toml)"
    done
    compgen -W "$names" -- "$current" | sort -u ;;
  @scenario)
    compgen -W "$("${COMP_WORDS[0]}" --help 2>/dev/null | sed -n 's/^Shipped scenarios: //p' | tr -d ,)" -- "$current"
    compgen -f -- "$current" ;;
  @*) ;;
  *) compgen -W "$*" -- "$current" ;;
  esac
}

FUNCTION() {
  local current=${COMP_WORDS[COMP_CWORD]} command=NAME option='' value='' options='' commands='' word place=0
  local -a operands=()
  [ "$current" != = ] || current=
  FUNCTION_table
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if [ -n "$option" ]; then
      [ "$word" = = ] || option=
    elif [[ $word = -* ]]; then
      option=$word; FUNCTION_table
      [ -n "$value" ] || option=
    elif [[ " $commands " = *" $word "* ]]; then
      command+=" $word"; place=0; FUNCTION_table
    else
      place=$((place + 1))
    fi
  done
  FUNCTION_table
  [ "$place" -lt "${#operands[@]}" ] || place=$((${#operands[@]} - 1))
  if [ -n "$option" ]; then
    :
  elif [[ $current = -* ]]; then
    value=$options
  else
    value=$commands
    [ -n "$value" ] || [ "$place" -lt 0 ] || value=${operands[place]}
  fi
  COMPREPLY=()
  case $value in '') return ;; @*) compopt -o filenames 2>/dev/null ;; esac
  # shellcheck disable=SC2086
  mapfile -t COMPREPLY < <(FUNCTION_values $value)
}
complete -F FUNCTION NAME
"""


def values(option):
    """Empty for a flag; @free where nothing is known of the value."""
    if option.choices:
        return " ".join(option.choices)
    return f"@{KINDS.get(option.kind, 'free')}" if option.kind else ""


def completion(program):
    commands, options = [], []
    for command in program.all():
        words = " ".join(word for option in command.known for word in option.names)
        below = " ".join(one.path[-1] for one in command.commands)
        operands = " ".join(shlex.quote(values(operand)) for operand in command.operands)
        commands.append(f"  {shlex.quote(command.name)}) options='{words}' commands='{below}' operands=({operands}) ;;")
        for option in command.known:
            if option.value:
                patterns = "|".join(shlex.quote(f"{command.name} {word}") for word in option.names)
                options.append(f"  {patterns}) value='{values(option)}' ;;")
    return (SCRIPT.replace("COMMANDS", "\n".join(commands)).replace("VALUES", "\n".join(options))
            .replace("FUNCTION", "_" + program.name.replace("-", "_")).replace("NAME", program.name))

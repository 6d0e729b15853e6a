#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Man pages and bash completion from the program's own help:
#   write_manuals.sh PROGRAM FOLDER
# leaves FOLDER/orbitfuse.1.gz, FOLDER/orbitfuse-VERB.1.gz and FOLDER/completion.
set -euo pipefail
program=$1 folder=$2
command -v help2man > /dev/null || {
  echo "help2man is missing: apt-get install help2man" >&2
  exit 1
}
rm -rf "$folder"
mkdir -p "$folder"

subcommands() { "$program" --help | sed -n '/^Subcommands:/,/^$/p' | sed -n 's/^  \([a-z]\+\)  *\(.*\)/\1 \2/p'; }

page() { # NAME ONE-LINER COMMAND
  help2man --no-info --name "$2" --version-string "$("$program" --version | cut -d' ' -f2)" \
    --manual OrbitFuse --source OrbitFuse "$3" |
    sed -e "s/^\.TH .*\"1\"/.TH $(tr a-z A-Z <<< "$1") \"1\"/" \
      -e "/^\.SH NAME/{n;s/.* \\\\-/$1 \\\\-/}" | gzip -9n > "$folder/$1.1.gz"
}

page orbitfuse "radiance fields of two camera orbits, fused from any view" "$program"
subcommands | while read -r verb words; do page "orbitfuse-$verb" "${words,}" "$program $verb"; done

{
  echo "# bash completion for orbitfuse; written from its help"
  echo "_orbitfuse() {"
  echo '  local current=${COMP_WORDS[COMP_CWORD]} options='
  echo '  if [ "$COMP_CWORD" -eq 1 ]; then'
  echo "    COMPREPLY=(\$(compgen -W '$(subcommands | cut -d' ' -f1 | tr '\n' ' ')help --help --version' -- \"\$current\"))"
  echo '    return'
  echo '  fi'
  echo '  case ${COMP_WORDS[1]} in'
  subcommands | while read -r verb _; do
    echo "    $verb) options='$("$program" "$verb" --help | grep -oE '^  (-[a-z],)?--[a-z][a-z-]*' | grep -oE -- '--.*' | sort -u | tr '\n' ' ')' ;;"
  done
  echo '  esac'
  echo '  case $current in'
  echo '    -*) COMPREPLY=($(compgen -W "$options" -- "$current")) ;;'
  echo '  esac'
  echo '}'
  echo 'complete -o default -F _orbitfuse orbitfuse'
} > "$folder/completion"

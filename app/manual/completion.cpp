// SPDX-License-Identifier: BSD-3-Clause
#include "app/manual/completion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace orbitfuse::manual {
namespace {

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return names;
}

/// "TEXT:{auto,key,off}", as CLI11 describes a set of values -> "auto key off"; "" without one.
std::string choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return {};
  std::string words = type.substr(open + 1, close - open - 1);
  std::replace(words.begin(), words.end(), ',', ' ');
  return words;
}

std::string joined(const std::vector<std::string>& words, const char* separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

constexpr const char* function_end = R"(  esac; fi
  [[ -n $words ]] && mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}
complete -o default -F _orbitfuse orbitfuse
)";

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::string verbs, values, options;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    verbs += verb->get_name() + " ";
    std::vector<std::string> all;
    for (const CLI::Option* option : verb->get_options()) {
      const std::vector<std::string> names = names_of(*option);
      all.insert(all.end(), names.begin(), names.end());
      const std::string choices = choices_of(*option);
      if (choices.empty() || names.empty()) continue;
      std::vector<std::string> patterns;
      for (const std::string& name : names)
        patterns.push_back("'" + verb->get_name() + " " + name + " '*");
      values += fmt::format("    {}) words='{}' ;;\n", joined(patterns, "|"), choices);
    }
    options += fmt::format("    '{} '*' -'*) words='{}' ;;\n", verb->get_name(), joined(all, " "));
  }
  return "# bash completion for orbitfuse, written from its command line when it was built\n"
         "_orbitfuse() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} words=\n"
         "  COMPREPLY=()\n"
         "  if [[ $COMP_CWORD -eq 1 ]]; then\n"
         "    words='" +
         verbs +
         "help --help --version'\n"
         "  else case \"${COMP_WORDS[1]} ${COMP_WORDS[COMP_CWORD-1]} $word\" in\n"
         "    'help '*) [[ $COMP_CWORD -eq 2 ]] && words='" +
         verbs + "' ;;\n" + values + options + function_end;
}

}  // namespace orbitfuse::manual

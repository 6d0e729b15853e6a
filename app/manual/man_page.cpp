// SPDX-License-Identifier: BSD-3-Clause
#include "app/manual/man_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace orbitfuse::manual {
namespace {

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

/// Text in which roff finds no command: a line that begins with a dot or a quote would be one, and
/// a bare hyphen is set as one that can't be copied into a shell.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
      out += c;
    }
  }
  return out;
}

std::string bold(const std::string& text) { return "\\fB" + escaped(text) + "\\fR"; }

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// `code` is bold, [words](where) are the words.
std::string inline_roff(const std::string& text) {
  std::string out, plain;
  const auto flush = [&] {
    out += escaped(plain);
    plain.clear();
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t code_end = text[i] == '`' ? text.find('`', i + 1) : std::string::npos;
    const std::size_t link = text[i] == '[' ? text.find("](", i) : std::string::npos;
    const std::size_t link_end =
        link == std::string::npos ? std::string::npos : text.find(')', link);
    if (code_end != std::string::npos) {
      flush();
      out += bold(text.substr(i + 1, code_end - i - 1));
      i = code_end;
    } else if (link_end != std::string::npos) {
      plain += text.substr(i + 1, link - i - 1);
      i = link_end;
    } else {
      plain += text[i];
    }
  }
  flush();
  return out;
}

/// "| 0 | done |" -> {"0", "done"}; nothing for the line below a table's head.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  for (std::size_t at = 1; at < line.size();) {
    const std::size_t end = std::min(line.find('|', at), line.size());
    const std::size_t first = line.find_first_not_of(' ', at);
    const std::size_t last = line.find_last_not_of(' ', end - 1);
    cells.push_back(first >= end ? "" : line.substr(first, last + 1 - first));
    at = end + 1;
  }
  return !cells.empty() && cells[0].starts_with("---") ? std::vector<std::string>{} : cells;
}

/// CLI11 writes the choices and defaults of an option in its help; this says them alike.
class HelpWords : public CLI::Formatter {
 public:
  std::string of(const CLI::Option& option) const { return make_option_opts(&option); }
};

std::string options_of(const CLI::App& app, bool positional, const std::string& group) {
  const HelpWords words;
  std::string out;
  for (const CLI::Option* option : app.get_options([&](const CLI::Option* o) {
         return o->get_positional() == positional && (positional || o->get_group() == group);
       })) {
    out += ".TP\n" + bold(option->get_name(positional, !positional)) + escaped(words.of(*option)) +
           "\n" + escaped(option->get_description()) + "\n";
  }
  return out;
}

std::string all_options(const CLI::App& app) {
  std::string out;
  const std::string arguments = options_of(app, true, "");
  if (!arguments.empty()) out += ".SH ARGUMENTS\n" + arguments;
  out += ".SH OPTIONS\n";
  for (const std::string& group : app.get_groups()) {
    const std::string options = group.empty() ? "" : options_of(app, false, group);
    if (options.empty()) continue;
    if (group != "Options") out += ".SS " + escaped(group) + "\n";
    out += options;
  }
  return out;
}

std::string example(const CLI::App& app) {
  std::string out = ".SH EXAMPLES\n.nf\n.RS\n";
  for (const std::string& line : lines_of(app.get_footer()))
    out += escaped(line.substr(std::min(line.find_first_not_of(' '), line.size()))) + "\n";
  return out + ".RE\n.fi\n";
}

std::string head(const std::string& name, const std::string& summary, const ManualFacts& facts) {
  return fmt::format(".TH {} 1 {} \"OrbitFuse {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n",
                     escaped(upper(name)), facts.date, escaped(facts.version), escaped(name),
                     escaped(summary));
}

std::string verb_page(const CLI::App& verb, const ManualFacts& facts) {
  std::string usage;
  for (const CLI::Option* option :
       verb.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    const std::string name = "\\fI" + escaped(option->get_name(true)) + "\\fR";
    usage += option->get_required() ? name + " " : "[" + name + "] ";
  }
  return head("orbitfuse-" + verb.get_name(), verb.get_description(), facts) + ".SH SYNOPSIS\n" +
         bold("orbitfuse " + verb.get_name()) + " " + usage + "[\\fIOPTIONS\\fR]\n" +
         all_options(verb) + example(verb) +
         ".SH SEE ALSO\n.BR orbitfuse (1),\nwhich tells exit codes and the order of options.\n";
}

std::string program_page(const CLI::App& app, const std::vector<const CLI::App*>& verbs,
                         const ManualFacts& facts) {
  std::string page = head("orbitfuse", app.get_description(), facts) +
                     ".SH SYNOPSIS\n.B orbitfuse\n\\fIVERB\\fR [\\fIOPTIONS\\fR]\n.SH VERBS\n";
  for (const CLI::App* verb : verbs) {
    page += ".TP\n.BR orbitfuse\\-" + escaped(verb->get_name()) + " (1)\n" +
            escaped(verb->get_description()) + "\n";
  }
  page += all_options(app) + ".SH DESCRIPTION\n" + roff_of_markdown(facts.introduction);
  page +=
      ".SH FILES\n"
      ".TP\n.I share/orbitfuse/orbitfuse.toml\nEvery key of the configuration with its default.\n"
      ".TP\n.I share/orbitfuse/cameras/\nProfiles of cameras for "
      ".BR orbitfuse\\-capture (1).\n"
      ".TP\n.I share/orbitfuse/replay_data/car/\nA recorded orbit to try everything on.\n"
      ".PP\nAll below the folder where "
      ".I bin/orbitfuse\nlies, e.g. /usr.\n";
  return page + example(app);
}

}  // namespace

std::string roff_of_markdown(const std::string& markdown) {
  std::string out;
  bool fresh = true, head_of_table = true;
  for (const std::string& line : lines_of(markdown)) {
    if (line.starts_with("#")) continue;
    if (line.empty()) {
      fresh = true;
      head_of_table = true;
    } else if (line.front() == '|') {
      const std::vector<std::string> cells = cells_of(line);
      if (cells.size() == 2 && !head_of_table)
        out += ".TP\n" + inline_roff(cells[0]) + "\n" + inline_roff(cells[1]) + "\n";
      head_of_table = false;
    } else {
      if (fresh && !out.empty()) out += ".PP\n";  // none after a heading
      fresh = false;
      out += inline_roff(line) + "\n";
    }
  }
  return out;
}

std::vector<ManPage> man_pages(const CLI::App& app, const ManualFacts& facts) {
  const std::vector<const CLI::App*> verbs =
      app.get_subcommands([](const CLI::App*) { return true; });
  std::vector<ManPage> pages = {{"orbitfuse", program_page(app, verbs, facts)}};
  for (const CLI::App* verb : verbs)
    pages.push_back({"orbitfuse-" + verb->get_name(), verb_page(*verb, facts)});
  return pages;
}

}  // namespace orbitfuse::manual

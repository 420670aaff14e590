#include "cli/command_line.h"
#include <fieldmark/core/files.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

TEST_CASE("command_line: NaN and infinity are refused wherever a number is expected") {
  for (const char* number : {"nan", "inf", "-inf", "NAN"}) {
    const Outcome r = run_command({"verify", "--owner", "o", "--message", "a5", "--fpr", number, "view.png"});
    CHECK(r.code == 2);
    CHECK_THAT(r.err, Contains("--fpr") && Contains("expected a finite number, got " + std::string(number)));
  }
}

TEST_CASE("command_line: an empty value is refused, also behind an equals sign") {
  CHECK_THAT(run_command({"info", ""}).err, Contains("expected a value, got an empty one"));
  const Outcome r = run_command({"info", "--json=", "file"});
  CHECK(r.code == 2);
  CHECK_THAT(r.err, Contains("--json: expected a value behind =, got an empty one"));
}

TEST_CASE("command_line: a whole number is what it looks like") {
  for (const char* value : {"010", "0x10", "1e3", "1.5", "18446744073709551616", "+1", " 1", "-1", "nan"}) {
    const Outcome r = run_command({"info", "file", "--seed", value});
    INFO(value << ": " << r.err);
    CHECK(r.code == 2);
    CHECK_THAT(r.err, Contains("--seed: expected a whole number from 0 to 18446744073709551615") &&
                          Contains("got " + std::string(value)));
  }
  CHECK(run_command({"info", "missing", "--seed", "18446744073709551615"}).code == 1);
  CHECK(run_command({"info", "missing", "--seed", "0"}).code == 1);
}

TEST_CASE("command_line: a value out of range is told the range as people write it") {
  const auto refused = [](const std::vector<std::string>& line, const std::string& text) {
    const Outcome r = run_command(line);
    INFO(r.err);
    CHECK(r.code == 2);
    CHECK_THAT(r.err, Contains(text));
  };
  for (const std::string value : {"0", "1.5", "5s", "1,5"})
    refused({"verify", "--owner", "o", "--message", "a5", "--fpr", value, "view.png"},
            "--fpr: expected a number from 1e-300 to 1, got " + value);
  refused(
      {"train", "--data", "d", "--out", "o", "--steps", "0"},
      "--steps: expected a whole number from 1 to 10000000 in decimal digits without leading zeros, got 0");
}

TEST_CASE("command_line: results replace neither an image nor a file that the command reads") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "data");
  const std::string inside = folder / "data/transforms_train.json";
  write_file_atomically(inside, "{}");
  for (const std::string option : {"--json", "--report"}) {
    const Outcome r = run_command({"data", "check", folder / "data", option, inside});
    CHECK(r.code == 2);
    CHECK_THAT(r.err, Contains(option + ": " + inside + " is a file of"));
    const Outcome image = run_command({"info", inside, option, folder / "o.PNG"});
    CHECK(image.code == 2);
    CHECK_THAT(image.err, Contains("o.PNG has the name of an image"));
  }
  CHECK(read_text(inside) == "{}");
}

namespace {

struct ListedOption {
  std::string name, type;
};

// Returns the first words of the lines below a title in a help text.
std::vector<std::string> names_below(const std::string& help, const std::string& title) {
  std::vector<std::string> names;
  std::istringstream lines(help.substr(std::min(help.find(title), help.size())));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && !line.empty())
    if (line.starts_with("  ") && line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
  return names;
}

// Returns the options of a help text that take a value: "  --seed N=1   ...".
std::vector<ListedOption> options_of(const std::string& help) {
  std::vector<ListedOption> options;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  --")) continue;
    std::istringstream words(line);
    ListedOption option;
    words >> option.name;
    if (words.get() != ' ' || words.peek() == ' ' || words.peek() < 'A') continue;  // a flag
    words >> option.type;
    if (option.type.ends_with(':')) continue;  // a flag with the options it excludes
    option.type.resize(std::min(option.type.find('='), option.type.size()));
    options.push_back(option);
  }
  return options;
}

// Returns every command with its subcommand, if it has one: {"bench", "engine"}.
std::vector<std::vector<std::string>> all_commands() {
  std::vector<std::vector<std::string>> commands;
  for (const std::string& name : names_below(run_command({"--help"}).out, "Subcommands:")) {
    const auto inner = names_below(run_command({name, "--help"}).out, "Subcommands:");
    if (inner.empty()) commands.push_back({name});
    for (const std::string& word : inner) commands.push_back({name, word});
  }
  return commands;
}

bool is_number(const std::string& type) {
  for (const char* known : {"N", "S", "DB", "P", "F", "M"})
    if (type == known) return true;
  return false;
}

}  // namespace

// Applies one rule to all options, so that options added later are tested too.
TEST_CASE("command_line: no option of any command takes an empty value, NaN or infinity") {
  int tried = 0, numbers = 0;
  for (const auto& command : all_commands()) {
    auto help = command;
    help.push_back("--help");
    for (const auto& [name, type] : options_of(run_command(help).out)) {
      std::vector<std::string> values{""};
      if (is_number(type)) values = {"", "nan", "-inf"};
      numbers += is_number(type);
      ++tried;
      for (const std::string& value : values) {
        auto words = command;
        words.insert(words.end(), {name, value});
        const Outcome r = run_command(words);
        INFO(command.front() << " " << command.back() << " " << name << " '" << value << "': " << r.err);
        CHECK(r.code == 2);
        CHECK_THAT(r.err, Contains(name));
      }
    }
  }
  CHECK(tried > 200);
  CHECK(numbers > 100);
}

TEST_CASE("command_line: a seed is a whole number from 0") {
  const Outcome r = run_command({"scene", "--out", "nowhere", "--seed", "-1"});
  CHECK(r.code == 2);
  CHECK_THAT(r.err, Contains("--seed"));
}

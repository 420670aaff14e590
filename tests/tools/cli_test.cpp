#include "cli/cli.h"
#include "cli/wrapped_help.h"

#include <algorithm>
#include <sstream>

#include "support/catch.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("fieldmark without a command is a usage error", "[cli]") {
  const auto r = run_command({});
  CHECK(r.code == cli::kUsage);
  CHECK(r.out.empty());
  CHECK_THAT(r.err, Contains("subcommand is required") && Contains("fieldmark --help"));
}

TEST_CASE("fieldmark --help lists the commands, --version the version", "[cli]") {
  const auto help = run_command({"--help"});
  CHECK(help.code == cli::kOk);
  CHECK_THAT(help.out, Contains("gradcheck"));
  CHECK(help.err.empty());
  const auto version = run_command({"--version"});
  CHECK(version.code == cli::kOk);
  CHECK_THAT(version.out, Contains("0.2.0"));
}

TEST_CASE("A wrong command or option is answered with the nearest one", "[cli]") {
  const auto command = run_command({"gradchek"});
  CHECK(command.code == cli::kUsage);
  CHECK(command.err ==
        "fieldmark: no command is called 'gradchek'; did you mean gradcheck? (see fieldmark --help)\n");
  const auto option = run_command({"gradcheck", "--sed", "3"});
  CHECK(option.code == cli::kUsage);
  CHECK_THAT(option.err,
             Contains("gradcheck: no option is called --sed; did you mean --seed? (see fieldmark gradcheck"));
  const auto with_value = run_command({"gradcheck", "--thread=2"});
  CHECK(with_value.code == cli::kUsage);
  CHECK_THAT(with_value.err, Contains("--thread; did you mean --threads?"));
  const auto second = run_command({"data", "ftch", "lego"});
  CHECK(second.code == cli::kUsage);
  CHECK(second.err ==
        "fieldmark: data: no command is called 'ftch'; did you mean fetch? (see fieldmark data --help)\n");
  const auto its_option = run_command({"bench", "tracing", "--ownr", "o"});
  CHECK(its_option.err ==
        "fieldmark: bench tracing: no option is called --ownr; did you mean --owner? (see fieldmark bench "
        "tracing "
        "--help)\n");
  const auto nested = run_command({"data", "fetch"});
  CHECK(nested.code == cli::kUsage);
  CHECK_THAT(nested.err, Contains("(see fieldmark data fetch --help)"));
  const auto far = run_command({"zzzzzz"});
  CHECK(far.code == cli::kUsage);
  CHECK(far.err.find("did you mean") == std::string::npos);
}

TEST_CASE("without_function: an error's text loses the function in brackets that it begins with", "[cli]") {
  CHECK(cli::without_function("[parse_hex] message: must be hexadecimal") == "message: must be hexadecimal");
  CHECK(cli::without_function("crop: must be in [0, 1] or so") == "crop: must be in [0, 1] or so");
  CHECK(cli::without_function("[never closed") == "[never closed");
  CHECK(cli::without_function("").empty());
}

TEST_CASE("An option's value out of range or of another kind is a usage error in one line", "[cli]") {
  for (const char* value : {"0", "1025", "two", "-1"}) {
    const auto r = run_command({"gradcheck", "--threads", value});
    INFO(value << ": " << r.err);
    CHECK(r.code == cli::kUsage);
    CHECK(r.out.empty());
    CHECK_THAT(r.err, Contains("--threads") && Contains(value));
    CHECK(std::count(r.err.begin(), r.err.end(), '\n') == 1);
  }
}

TEST_CASE("Every command has help that names the common options", "[cli]") {
  const auto list = run_command({"--help"}).out;
  std::istringstream lines(list.substr(list.find("Subcommands:")));
  std::string line;
  std::getline(lines, line);
  int commands = 0;
  while (std::getline(lines, line) && !line.empty()) {
    std::string name;
    if (!line.starts_with("  ") || line[2] == ' ' || !(std::istringstream(line) >> name)) continue;
    const auto r = run_command({name, "--help"});
    INFO(name);
    CHECK(r.code == cli::kOk);
    CHECK(r.err.empty());
    for (const char* option : {"--help", "--seed", "--threads", "--json", "--report"})
      CHECK_THAT(r.out, Contains(option));
    std::istringstream help(r.out);
    for (std::string text; std::getline(help, text);) CHECK(text.size() <= cli::WrappedHelp::kWidth);
    ++commands;
  }
  CHECK(commands >= 20);
}

TEST_CASE("Help of a second word says that the common options apply", "[cli]") {
  const auto r = run_command({"data", "check", "--help"});
  CHECK(r.code == cli::kOk);
  CHECK_THAT(r.out, Contains("--threads, --json and --report of `fieldmark data` apply too"));
}

TEST_CASE("A file for results that another option names is refused before any work", "[cli]") {
  const auto train = run_command({"train", "--data", "d", "--out", "sub/../f.fm", "--json", "f.fm"});
  CHECK(train.code == cli::kUsage);
  CHECK_THAT(train.err, Contains("--json: f.fm is the value of --out too; name another file"));
  const auto page = run_command({"export", "--field", "f", "--out", "a.html", "--report", "a.html"});
  CHECK(page.code == cli::kUsage);
  CHECK_THAT(page.err, Contains("--report: a.html is the value of --out too"));
  const auto nested = run_command({"data", "check", "d", "--cameras", "c.png", "--json", "c.png"});
  CHECK_THAT(nested.err, Contains("--json: c.png is the value of --cameras too"));
  // A message is not a file.
  CHECK_THAT(run_command({"verify", "--owner", "o", "--message", "a3", "--json", "a3", "v"}).err,
             !Contains("value of"));
}

TEST_CASE("Standard output that cannot be written is a failure", "[cli]") {
  std::ostringstream out, err;
  out.setstate(std::ios::badbit);
  const char* argv[] = {"fieldmark", "--help"};
  CHECK(cli::run(2, argv, out, err) == cli::kFailed);
  CHECK(err.str() == "fieldmark: standard output: cannot be written\n");
}

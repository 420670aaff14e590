#pragma once
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <type_traits>
#include <vector>

// The options of a command, based on CLI11. That header costs each source that includes it ten seconds of
// compile time, so only command_line.cpp, cli.cpp and wrapped_help include it.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace fieldmark::cli {

/// An option or positional argument of a command; each call refines it and returns it.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}
  Option* operator->() { return this; }
  const Option* operator->() const { return this; }

  Option required();
  /// Sets the placeholder of the value in help texts, as in `--bits N`.
  Option type_name(const std::string& name);
  /// Sets the default shown in help texts instead of the variable's value; empty: none.
  Option default_str(const std::string& text);
  Option group(const std::string& name);
  /// Rejects numbers outside [low, high], and fractions if both bounds are integers.
  template <class T>
  Option range(T low, T high) {
    if constexpr (std::is_integral_v<T>)
      return whole(low, high);
    else
      return real(low, high);
  }
  Option one_of(const std::vector<std::string>& names);
  Option one_of(std::initializer_list<int> values);
  /// Rejects values for which `fault` returns a text.   @param name  by which the check may be replaced
  Option check(std::function<std::string(const std::string& value)> fault, const std::string& name = "");
  /// Requires another option, or excludes it.
  Option needs(Option other);
  Option excludes(Option other);
  /// Splits one value at this character into several.
  Option delimiter(char character);
  /// Takes one value per occurrence of a list option, so that positional arguments may follow it.
  Option one_value();
  /// Returns how often the option was given.
  std::size_t count() const;

 private:
  Option whole(std::int64_t low, std::int64_t high);
  Option real(double low, double high);
  Option narrow(std::function<std::string(const std::string& value)> fault);
  CLI::Option* option_;
};

/// The options that a command accepts. For all of them, values are not empty, numbers are finite, and
/// integers are written in decimal digits and fit their type.
class CommandLine {
 public:
  explicit CommandLine(CLI::App& app) : app_(&app) {}
  /// Adds an option whose name begins with dashes, or a positional argument. `value` is its default, and must
  /// outlive the parse. T is std::string, std::vector<std::string>, double, int, std::int64_t or
  /// std::uint64_t.
  template <class T>
  Option add_option(const std::string& name, T& value, const std::string& help);
  Option add_flag(const std::string& name, bool& value, const std::string& help);
  /// Returns an option that was added before.
  Option option(const std::string& name);
  /// Adds a word that follows the command's own, as in `data fetch`; exactly one of them must be given.
  CommandLine add_subcommand(const std::string& name, const std::string& help);
  /// True if this command was called.
  bool parsed() const;

 private:
  CLI::App* app_;
};

}  // namespace fieldmark::cli

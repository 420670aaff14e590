#include "cli/command_line.h"

#include <fieldmark/core/number_text.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <system_error>

namespace fieldmark::cli {
namespace {

constexpr const char* kNumber = "number";  // name of the check that whole() and real() narrow

std::string fault_of_number(const std::string& text, double low, double high) {
  double value = 0;
  const bool number = CLI::detail::lexical_cast(text, value);
  if (number && !std::isfinite(value)) return "expected a finite number, got " + text;
  if (number && value >= low && value <= high) return "";
  return "expected a number from " + number_text(low) + " to " + number_text(high) + ", got " + text;
}

// CLI11 reads 010 as 8 and 0x10 as 16, and truncates values beyond the range of the type.
template <class T>
std::string fault_of_whole(const std::string& text, T low, T high) {
  T value{};
  const std::size_t first = text.starts_with('-') ? 1 : 0;
  const bool octal = text.size() > first + 1 && text[first] == '0';
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc{} && end == text.data() + text.size() && !octal;
  if (whole && value >= low && value <= high) return "";
  return "expected a whole number from " + number_text(low) + " to " + number_text(high) +
         " in decimal digits without leading zeros, got " + text;
}

std::string fault_of_empty(const std::string& text) {
  return text.empty() ? "expected a value, got an empty one" : "";
}

// Returns the value type of an option, without the optional around it.
template <class T>
struct Held {
  using type = T;
};
template <class T>
struct Held<std::optional<T>> {
  using type = T;
};

}  // namespace

Option Option::required() { return option_->required(), *this; }
Option Option::type_name(const std::string& name) { return option_->type_name(name), *this; }
Option Option::default_str(const std::string& text) { return option_->default_str(text), *this; }
Option Option::group(const std::string& name) { return option_->group(name), *this; }
// Without a description: help texts, which name the range in words, would repeat it.
Option Option::whole(std::int64_t low, std::int64_t high) {
  return narrow([=](const std::string& text) { return fault_of_whole(text, low, high); });
}
Option Option::real(double low, double high) {
  return narrow([=](const std::string& text) { return fault_of_number(text, low, high); });
}
Option Option::narrow(std::function<std::string(const std::string&)> fault) {
  option_->get_validator(kNumber)->operation(
      [fault = std::move(fault)](std::string& value) { return fault(value); });
  return *this;
}
Option Option::one_of(const std::vector<std::string>& names) {
  return option_->check(CLI::IsMember(names).description("")), *this;
}
Option Option::one_of(std::initializer_list<int> values) {
  return option_->check(CLI::IsMember(std::vector<int>(values)).description("")), *this;
}
Option Option::check(std::function<std::string(const std::string&)> fault, const std::string& name) {
  const auto checked = [fault = std::move(fault)](std::string& value) { return fault(value); };
  return option_->check(CLI::Validator(checked, "", name)), *this;
}
Option Option::needs(Option other) { return option_->needs(other.option_), *this; }
Option Option::excludes(Option other) { return option_->excludes(other.option_), *this; }
Option Option::delimiter(char character) { return option_->delimiter(character), *this; }
Option Option::one_value() { return option_->allow_extra_args(false), *this; }
std::size_t Option::count() const { return option_->count(); }

template <class T>
Option CommandLine::add_option(const std::string& name, T& value, const std::string& help) {
  Option option(app_->add_option(name, value, help));
  using Value = typename Held<T>::type;
  option.check(fault_of_empty);
  using Limits = std::numeric_limits<Value>;
  if constexpr (std::is_floating_point_v<Value>)
    option.check(
        [](const std::string& text) { return fault_of_number(text, Limits::lowest(), Limits::max()); },
        kNumber);
  if constexpr (std::is_integral_v<Value>)
    option.check([](const std::string& text) { return fault_of_whole(text, Limits::min(), Limits::max()); },
                 kNumber);
  return option;
}
template Option CommandLine::add_option(const std::string&, std::string&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::vector<std::string>&, const std::string&);
template Option CommandLine::add_option(const std::string&, double&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<double>&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<std::int64_t>&, const std::string&);
template Option CommandLine::add_option(const std::string&, int&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::int64_t&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::uint64_t&, const std::string&);

Option CommandLine::add_flag(const std::string& name, bool& value, const std::string& help) {
  return Option(app_->add_flag(name, value, help));
}

Option CommandLine::option(const std::string& name) { return Option(app_->get_option(name)); }

CommandLine CommandLine::add_subcommand(const std::string& name, const std::string& help) {
  app_->require_subcommand(1);
  app_->fallthrough();
  CLI::App* added = app_->add_subcommand(name, help)->fallthrough();
  added->footer("The options --seed, --threads, --json and --report of `fieldmark " + app_->get_name() +
                "` apply too.");
  return CommandLine(*added);
}

bool CommandLine::parsed() const { return app_->parsed(); }

}  // namespace fieldmark::cli
